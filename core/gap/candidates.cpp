#include "candidates.hpp"

#include <algorithm>

namespace thermbal {
namespace {

bool is_there_already(const Model& model, const std::string& kind, const std::string& at) {
    return std::ranges::any_of(model.effects,
                               [&](const Effect& effect) { return effect.kind == kind && effect.at == at; });
}

}  // namespace

std::vector<Candidate> all_candidates(const Model& model, const std::vector<std::string>& columns) {
    std::vector<Candidate> candidates;
    for (const EffectDefinition& definition : effect_catalogue()) {
        for (const EffectForm& form : definition.forms) {
            if (form.steers_itself || form.refines_first) continue;
            const auto places = form.site == EffectSite::column ? columns : possible_places(form, model);
            for (const std::string& at : places) {
                if (!is_there_already(model, definition.kind, at))
                    candidates.push_back({&definition, &form, at});
            }
        }
    }
    return candidates;
}

std::vector<Screened> refined(const Screened& first, const Model& model) {
    std::vector<Screened> found;
    const EffectDefinition& definition = *first.candidate.definition;
    for (const EffectForm& form : definition.forms) {
        if (!form.refines_first || first.candidate.form != &definition.forms.front()) continue;
        Screened one{{&definition, &form, first.candidate.at},
                     make_effect(definition, form, first.candidate.at, model),
                     first.log_likelihood_gain};
        for (const auto& parameter : first.start.parameters)
            one.start.set_parameter(parameter.name, parameter.value);
        found.push_back(std::move(one));
    }
    return found;
}

}  // namespace thermbal
