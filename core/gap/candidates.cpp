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
            if (form.steers_itself) continue;  // screen_thermostats
            const auto places = form.site == EffectSite::column ? columns : possible_places(form, model);
            for (const std::string& at : places) {
                if (!is_there_already(model, definition.kind, at))
                    candidates.push_back({&definition, &form, at});
            }
        }
    }
    return candidates;
}

}  // namespace thermbal
