#include "network/effect.hpp"

namespace thermbal {

#define THERMBAL_EFFECT(kind) EffectDefinition kind##_effect();
#include "effects/list.inc"
#undef THERMBAL_EFFECT

const std::vector<EffectDefinition>& effect_catalogue() {
    static const std::vector<EffectDefinition> catalogue = {
#define THERMBAL_EFFECT(kind) kind##_effect(),
#include "effects/list.inc"
#undef THERMBAL_EFFECT
    };
    return catalogue;
}

}  // namespace thermbal
