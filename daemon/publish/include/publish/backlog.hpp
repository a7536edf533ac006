#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "base/error.hpp"
#include "publish/topics.hpp"
#include "store/feed.hpp"

namespace thermbal {

/// One message, and the position of everything up to it.
struct Message {
    std::string topic;
    std::string payload;
    FeedPosition after;
};

/// What a database holds after `from`, as at most about `most` messages, in the order to send them:
/// declarations, events, revised scans, new scans, each oldest first. Empty when there is nothing. Errors as
/// Feed.
Result<std::vector<Message>> next_messages(const Feed& feed, const Topics& topics, const FeedPosition& from,
                                           std::int64_t most);

/// The retained message about the newest test; `null` (as JSON) without a test.
Result<std::string> test_message(const Feed& feed);

/// JSON as it goes out: one line; bytes that are no UTF-8 are replaced.
std::string payload_text(const nlohmann::json& payload);

}  // namespace thermbal
