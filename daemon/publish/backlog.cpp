#include "publish/backlog.hpp"

#include <map>

#include "publish/payloads.hpp"

namespace thermbal {
namespace {

using nlohmann::json;

/// Collects messages and the position behind them.
class Batch {
  public:
    Batch(const Feed& feed, const Topics& topics, FeedPosition from, std::int64_t most)
        : feed_(feed), topics_(topics), position_(std::move(from)), most_(most) {}

    Result<void> add_declarations() {
        return add(feed_.declarations_after(position_, room()), [&](const auto& row, const StoredTest& test) {
            return Content{topics_.declarations(row.record.channel),
                           declaration_payload(feed_.database_id(), test, row.record)};
        });
    }

    Result<void> add_events() {
        const auto rows = feed_.events_after(position_, room());
        if (!rows) return std::unexpected(rows.error());
        for (const auto& row : *rows)
            append({topics_.events(), event_payload(feed_.database_id(), row.record)}, row.position);
        return {};
    }

    Result<void> add_revisions() { return add_scans(feed_.revisions_after(position_, room()), true); }
    Result<void> add_new_scans() { return add_scans(feed_.scans_after(position_, room()), false); }

    std::vector<Message> take() { return std::move(messages_); }

  private:
    struct Content {
        std::string topic;
        json payload;
    };

    std::int64_t room() const { return most_ - static_cast<std::int64_t>(messages_.size()); }

    void append(const Content& content, const FeedPosition& after) {
        position_ = after;
        messages_.push_back({content.topic, payload_text(content.payload), after});
    }

    Result<void> add_scans(const Result<std::vector<FeedRow<ScanRecord>>>& rows, bool revised) {
        return add(rows, [&](const auto& row, const StoredTest& test) {
            return Content{topics_.samples(),
                           samples_payload(feed_.database_id(), test, row.record, revised)};
        });
    }

    template <typename Record, typename MakeContent>
    Result<void> add(const Result<std::vector<FeedRow<Record>>>& rows, const MakeContent& make_content) {
        if (!rows) return std::unexpected(rows.error());
        for (const auto& row : *rows) {
            const auto test = test_of(row.test_id);
            if (!test) return std::unexpected(test.error());
            append(make_content(row, **test), row.position);
        }
        return {};
    }

    Result<const StoredTest*> test_of(TestId id) {
        if (const auto known = tests_.find(id); known != tests_.end()) return &known->second;
        auto test = feed_.read().test(id);
        if (!test) return std::unexpected(test.error());
        return &tests_.emplace(id, std::move(*test)).first->second;
    }

    const Feed& feed_;
    const Topics& topics_;
    FeedPosition position_;
    std::int64_t most_;
    std::vector<Message> messages_;
    std::map<TestId, StoredTest> tests_;
};

}  // namespace

std::string payload_text(const json& payload) {
    return payload.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<std::vector<Message>> next_messages(const Feed& feed, const Topics& topics, const FeedPosition& from,
                                           std::int64_t most) {
    Batch batch(feed, topics, from, most);
    for (const auto step :
         {&Batch::add_declarations, &Batch::add_events, &Batch::add_revisions, &Batch::add_new_scans})
        if (auto added = (batch.*step)(); !added) return std::unexpected(added.error());
    return batch.take();
}

Result<std::string> test_message(const Feed& feed) {
    const auto test = feed.read().newest_test();
    if (!test) return std::unexpected(test.error());
    if (!*test) return payload_text(nullptr);
    const auto declarations = feed.read().declarations((*test)->id);
    if (!declarations) return std::unexpected(declarations.error());
    return payload_text(test_payload(feed.database_id(), **test, *declarations));
}

}  // namespace thermbal
