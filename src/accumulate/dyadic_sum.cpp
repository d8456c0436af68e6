// SPDX-License-Identifier: Apache-2.0
#include "accumulate/dyadic_sum.h"

#include "base/check.h"

#include <algorithm>

namespace velatura::accumulate {

bool DyadicRule::is_final(const DyadicNode& n) const {
    if (final_end_ == 0 || !is_aligned(n)) return false;
    const uint64_t parent_size = 2 * (n.end - n.begin);
    const uint64_t parent_begin = n.begin & ~(parent_size - 1);
    return parent_begin < first_ || parent_begin + parent_size > final_end_;
}

bool DyadicRule::can_join(const DyadicNode& a, const DyadicNode& b) {
    if (a.is_final && b.is_final) return true;
    const uint64_t size = b.end - b.begin;
    return a.end == b.begin && a.end - a.begin == size && is_aligned(a) && is_aligned(b) &&
           (a.begin & (2 * size - 1)) == 0;
}

std::vector<DyadicNode> DyadicRule::nodes(uint64_t begin, uint64_t end) const {
    std::vector<DyadicNode> list;
    set_nodes(begin, end, list);
    return list;
}

void DyadicRule::set_nodes(uint64_t begin, uint64_t end, std::vector<DyadicNode>& list) const {
    list.clear();
    for (uint64_t at = begin; at < end;) {
        // The largest aligned node that starts here and does not run past the end
        uint64_t size = std::bit_floor(end - at);
        if (at != 0) size = std::min(size, at & (~at + 1));
        push(list, {at, at + size, false}, [](size_t) {});
        at += size;
    }
}

void SparseDyadicSum::add(uint64_t first, uint64_t sample, const Triple& value) {
    // Adding +0 turns −0 into +0, so that samples without a value count exactly like zero
    const Triple leaf = value + Triple{};
    if (leaf.is_zero()) return;
    // Join what the nodes finished before this sample hold
    while (entries_.size() >= 2) {
        const uint64_t a = entries_[entries_.size() - 2].sample;
        const uint64_t b = entries_.back().sample;
        const bool is_finished = std::bit_width(a ^ b) < std::bit_width(b ^ sample);
        if (!is_finished || !common_node_starts_at_or_after(a, b, first)) break;
        entries_[entries_.size() - 2].value += entries_.back().value;
        entries_.pop_back();
    }
    VELATURA_DCHECK(entries_.empty() || entries_.back().sample < sample, "samples must ascend");
    entries_.push_back({sample, leaf});
}

void SparseDyadicSum::finish(uint64_t first,
                             const std::vector<DyadicNode>& nodes,
                             std::vector<Triple>& sums) {
    sums.assign(nodes.size(), Triple{});
    if (entries_.empty()) return;
    size_t node = nodes.size() - 1;
    // From the last sample down: inside one node the right neighbor joins first
    Triple value = entries_.back().value;
    uint64_t sample = entries_.back().sample;
    while (nodes[node].begin > sample) --node;
    for (size_t i = entries_.size() - 1; i-- > 0;) {
        if (entries_[i].sample >= nodes[node].begin) {
            value = entries_[i].value + value;
            continue;
        }
        sums[node] = value;
        value = entries_[i].value;
        sample = entries_[i].sample;
        while (nodes[node].begin > sample) --node;
    }
    sums[node] = value;
    VELATURA_DCHECK(sample >= first, "sample before the range");
    static_cast<void>(first);
}

namespace {

/// sum += other, two triples at a time, which compilers turn into additions of pairs.
void add_to(Triple* __restrict sum, const Triple* __restrict other, size_t count) {
    for (size_t c = 0; c < count; c += 2) {
        sum[c] += other[c];
        sum[c + 1] += other[c + 1];
    }
}

}  // namespace

void DenseDyadicSums::begin(uint64_t first) {
    nodes_.clear();
    sample_ = first;
    width_ = 0;
}

size_t DenseDyadicSums::add_column() {
    VELATURA_DCHECK(width_ < capacity, "more columns than allocated");
    for (size_t i = 0; i <= nodes_.size(); ++i) row(i)[width_] = {};
    return width_++;
}

void DenseDyadicSums::next_sample() {
    nodes_.push_back({sample_++, 1});
    // Join siblings: neighbors of one size, the left one where a node twice as large begins
    while (nodes_.size() >= 2) {
        Node& left = nodes_[nodes_.size() - 2];
        if (left.size != nodes_.back().size || (left.begin & left.size) != 0) break;
        add_to(row(nodes_.size() - 2), row(nodes_.size() - 1), width_);
        left.size *= 2;
        nodes_.pop_back();
    }
    if (rows_.size() < (nodes_.size() + 1) * capacity) rows_.resize((nodes_.size() + 1) * capacity);
    std::fill_n(row(nodes_.size()), width_ + width_ % 2, Triple{});
}

void DenseDyadicSums::finish(size_t column, std::vector<Triple>& sums) const {
    sums.resize(nodes_.size());
    for (size_t i = 0; i < nodes_.size(); ++i) sums[i] = rows_[i * capacity + column];
}

}  // namespace velatura::accumulate
