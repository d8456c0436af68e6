// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace velatura::usd::compose {

/// Kinds of tasks, in the order in which they are done. The kinds and their order follow Pixar's
/// Pcp.
enum class Task : uint8_t {
    Relocates,
    ImpliedRelocates,
    References,
    Payloads,
    Inherits,
    Specializes,
    ImpliedClasses,
    AncestralVariantSets,
    AncestralVariants,
    AncestralFallbacks,
    ImpliedSpecializes,
    VariantSets,
    Variants,
    Fallbacks,
    UnresolvedPaths
};

inline constexpr size_t task_count = size_t(Task::UnresolvedPaths) + 1;

/// Nodes of a graph that wait, by kind of task. Variant sets wait in VariantArcs.
class TaskQueue {
  public:
    void add(Task task, int node);

    /// Removes the node whose turn it is; -1 when none waits.
    int take(Task task) { return nodes_[size_t(task)].empty() ? -1 : pop(task); }

  private:
    int pop(Task task);

    std::array<std::vector<int>, task_count> nodes_;  ///< heaps
};

}  // namespace velatura::usd::compose
