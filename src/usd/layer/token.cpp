// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/token.h"

#include "base/hash.h"
#include "usd/layer/pointer_table.h"

#include <array>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>

namespace velatura::usd::layer {

namespace {

// One lock per shard keeps threads out of each other's way
struct Shard {
    std::mutex mutex;
    PointerTable<const std::string> index;
    std::deque<std::string> texts;
};

constexpr int shard_bits = 6;

std::array<Shard, size_t(1) << shard_bits>& shards() {
    // Never destroyed: tokens in static objects must outlive everything
    static auto* const table = new std::array<Shard, size_t(1) << shard_bits>;
    return *table;
}

}  // namespace

const std::string* Token::empty_text() {
    static const std::string* const text = new std::string;
    return text;
}

const std::string* Token::intern(std::string_view text) {
    if (text.empty()) return empty_text();
    const uint64_t h = mix64(std::hash<std::string_view>()(text));
    // The tables use the low bits
    Shard& shard = shards()[h >> (64 - shard_bits)];
    const std::lock_guard lock(shard.mutex);
    const std::string* known = shard.index.find(h, [&](const std::string& t) { return t == text; });
    if (known) return known;
    shard.texts.emplace_back(text);
    shard.index.insert(h, &shard.texts.back());
    return &shard.texts.back();
}

}  // namespace velatura::usd::layer
