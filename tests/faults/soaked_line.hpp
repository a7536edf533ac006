#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "acquisition/line_reader.hpp"
#include "rig.hpp"
#include "stall_meter.hpp"

namespace thermbal::soak {

/// What a scan was like, as only the study knows.
struct ScanFacts {
    bool clean = false;           ///< it began after the fault had ended, and ended before the next one began
    double took_s = 0.0;          ///< real time
    double host_stalled_s = 0.0;  ///< by StallMeter and Rig, from the scan before on
    std::string error;            ///< of the first unit that failed
};

/// All units of the rig on one real link. Tells the rig which scan it is.
class SoakedLine final : public Line {
  public:
    SoakedLine(Rig& rig, const LinkOptions& options);

    std::vector<ChannelSample> read_scan() override;
    Result<void> write(const RegisterWrite& /*write*/) override { return {}; }

    /// Of the last scan; between its mail and the settling of its clock nobody else touches it.
    const ScanFacts& facts() const { return facts_; }
    /// Since the last scan began. Any thread.
    double host_stalled_s() const { return std::max(stalls_.worst_s(), rig_.worst_stall_s()); }
    /// No scan takes longer, whatever the module does: the shortest period that a configuration may ask for.
    double bound_s() const { return bound_s_; }

  private:
    Rig& rig_;
    const LinkOptions options_;
    std::unique_ptr<Link> link_;
    std::vector<UnitPlan> plans_;
    double bound_s_ = 0.0;
    std::int64_t scan_ = 0;
    StallMeter stalls_;
    ScanFacts facts_;
};

}  // namespace thermbal::soak
