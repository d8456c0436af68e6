// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::accumulate {

/// Three doubles that are summed together: a color, a vector or three counters.
struct Triple {
    double x = 0, y = 0, z = 0;

    bool operator==(const Triple&) const = default;

    bool is_zero() const { return x == 0.0 && y == 0.0 && z == 0.0; }

    Triple& operator+=(const Triple& o) {
        x += o.x;
        y += o.y;
        z += o.z;
        return *this;
    }

    friend Triple operator+(Triple a, const Triple& b) { return a += b; }
};

/// Sum over samples [begin, end). An aligned node [i·2^k, (i+1)·2^k) is the sum of its two
/// children; `is_final` marks a run of nodes that have no parent inside the samples that will ever
/// come, and are therefore folded already.
struct DyadicNode {
    uint64_t begin = 0, end = 0;
    bool is_final = false;

    bool operator==(const DyadicNode&) const = default;
};

/// Addition of doubles is not associative; this class fixes one order that every split of the
/// samples can follow. Samples [first, …) are summed by the binary tree over the sample index; a
/// range is the list of its maximal aligned nodes; two adjacent ranges join by adding siblings,
/// which gives the bits that one run over both gives.
class DyadicRule {
  public:
    /// `final_end` as in SampleSums; 0 = unknown.
    explicit DyadicRule(uint64_t first, uint64_t final_end = 0)
        : first_(first), final_end_(final_end) {}

    /// Maximal aligned nodes of [begin, end), ascending; final ones joined.
    std::vector<DyadicNode> nodes(uint64_t begin, uint64_t end) const;
    /// The same into a list that may have room already.
    void set_nodes(uint64_t begin, uint64_t end, std::vector<DyadicNode>& list) const;

    /// Appends a node behind `nodes` and joins what can be joined; add(i) must add value i+1 to
    /// value i and drop i+1, where i counts positions in `nodes`.
    template <class Join>
    void push(std::vector<DyadicNode>& nodes, DyadicNode node, const Join& join) const {
        node.is_final = node.is_final || is_final(node);
        nodes.push_back(node);
        while (nodes.size() >= 2 && can_join(nodes[nodes.size() - 2], nodes.back())) {
            DyadicNode& left = nodes[nodes.size() - 2];
            left.end = nodes.back().end;
            left.is_final = (left.is_final && nodes.back().is_final) || is_final(left);
            nodes.pop_back();
            join(nodes.size() - 1);
        }
    }

  private:
    static bool is_aligned(const DyadicNode& n) {
        const uint64_t size = n.end - n.begin;
        return std::has_single_bit(size) && (n.begin & (size - 1)) == 0;
    }

    bool is_final(const DyadicNode& n) const;
    static bool can_join(const DyadicNode& a, const DyadicNode& b);

    uint64_t first_, final_end_;
};

/// Smallest aligned node that holds samples a < b; true if it lies in [first, …).
inline bool common_node_starts_at_or_after(uint64_t a, uint64_t b, uint64_t first) {
    const int level = std::bit_width(a ^ b);
    return level >= 64 ? first == 0 : ((a >> level) << level) >= first;
}

/// The sum over one pixel's samples of one accumulator, fed sample by sample with the samples that
/// are not zero. Equal bit for bit to the tree that adds the zeros as well, since x + 0 = x.
class SparseDyadicSum {
  public:
    void clear() { entries_.clear(); }

    bool is_empty() const { return entries_.empty(); }

    /// `sample` must grow from call to call; `first` is the range's first sample.
    void add(uint64_t first, uint64_t sample, const Triple& value);
    /// Sums per canonical node of [first, end), as listed in `nodes`.
    void finish(uint64_t first, const std::vector<DyadicNode>& nodes, std::vector<Triple>& sums);

  private:
    struct Entry {
        uint64_t sample;  ///< any sample of the node that the value stands for
        Triple value;
    };

    std::vector<Entry> entries_;
};

/// The same sums of up to `capacity` accumulators side by side, fed sample by sample, samples that
/// are zero included: what most samples touch costs an addition and no search. Equal bit for bit to
/// SparseDyadicSum.
class DenseDyadicSums {
  public:
    static constexpr size_t capacity = 48;

    DenseDyadicSums() : rows_(capacity) {}

    /// Starts anew with samples from `first` on and without columns.
    void begin(uint64_t first);
    /// Adds a column, which is zero for the samples so far.
    size_t add_column();

    /// The value of a column at the sample that next_sample() ends.
    Triple& at(size_t column) { return row(nodes_.size())[column]; }

    void next_sample();

    /// The sum of the first of these nodes; there must be a sample.
    const Triple& first(size_t column) const { return rows_[column]; }

    /// Sums per canonical node of the samples so far, ascending.
    void finish(size_t column, std::vector<Triple>& sums) const;

  private:
    struct Node {
        uint64_t begin, size;
    };

    Triple* row(size_t i) { return rows_.data() + i * capacity; }

    std::vector<Triple> rows_;  ///< [node, then the open sample][capacity]
    std::vector<Node> nodes_;
    uint64_t sample_ = 0;
    size_t width_ = 0;
};

}  // namespace velatura::accumulate
