#pragma once

#include <string>
#include <string_view>

namespace thermbal {

/// A name as one level of a topic: what MQTT reserves (/ + # $ at the start, control characters), and %,
/// become %XX as in a URI; an empty name becomes "_". MQTT 3.1.1, sections 4.7.1 and 1.5.3.
std::string topic_level(std::string_view name);

/// The topics of one machine: PREFIX/MACHINE/status, test, samples, declarations/CHANNEL, events.
class Topics {
  public:
    /// `prefix` may have several levels ("plant/hall 3"); empty levels are left out.
    Topics(std::string_view prefix, std::string_view machine);

    std::string status() const { return root_ + "/status"; }
    std::string test() const { return root_ + "/test"; }
    std::string samples() const { return root_ + "/samples"; }
    std::string events() const { return root_ + "/events"; }
    std::string declarations(std::string_view channel) const {
        return root_ + "/declarations/" + topic_level(channel);
    }

  private:
    std::string root_;
};

}  // namespace thermbal
