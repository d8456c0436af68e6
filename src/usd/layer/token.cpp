// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/token.h"

#include "base/hash.h"

#include <array>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_set>

namespace velatura::usd::layer {

namespace {

struct TextHash {
    using is_transparent = void;

    size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
};

// One lock per shard keeps readers on several threads out of each other's way
struct Shard {
    std::shared_mutex mutex;
    std::unordered_set<std::string, TextHash, std::equal_to<>> texts;
};

constexpr size_t shard_count = 64;

std::array<Shard, shard_count>& shards() {
    // Never destroyed: tokens in static objects must outlive everything
    static auto* const table = new std::array<Shard, shard_count>;
    return *table;
}

}  // namespace

const std::string* Token::empty_text() {
    static const std::string* const text = new std::string;
    return text;
}

const std::string* Token::intern(std::string_view text) {
    if (text.empty()) return empty_text();
    Shard& shard = shards()[mix64(TextHash()(text)) % shard_count];
    {
        const std::shared_lock lock(shard.mutex);
        const auto it = shard.texts.find(text);
        if (it != shard.texts.end()) return &*it;
    }
    const std::unique_lock lock(shard.mutex);
    return &*shard.texts.emplace(text).first;
}

}  // namespace velatura::usd::layer
