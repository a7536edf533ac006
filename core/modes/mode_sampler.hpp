#pragma once

#include <cstdint>
#include <vector>

#include "mode.hpp"

namespace thermbal {

/// Reversible-jump Metropolis-Hastings (Green 1995) over number, time constants and variances of the modes,
/// the amplitudes marginalised: birth, death, moves of one mode. Returns the states kept: every `thinning`-th
/// after `burn_in`.
std::vector<std::vector<Mode>> sample_modes(const std::vector<WhitenedChannel>& channels,
                                            const ModePrior& prior, std::size_t burn_in, std::size_t kept,
                                            std::size_t thinning, std::uint64_t seed);

}  // namespace thermbal
