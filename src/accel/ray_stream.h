// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/accelerator.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace velatura::accel {

/// Traces rays of one kind (from the camera, after the first bounce, towards lights …) through an
/// accelerator, each by itself or many side by side, whichever is faster in this scene on this
/// machine: parts of some early batches take turns and are timed. Coherent rays and small scenes
/// favor one by one, incoherent rays in large scenes side by side. What is hit does not depend on
/// it.
///
/// One for each kind and thread; the accelerator must outlive it.
class RayStream {
  public:
    explicit RayStream(const Accelerator& accelerator);

    /// Batches of fewer rays are not traced side by side.
    static constexpr size_t smallest_batch = 128;
    /// Batches of fewer rays are not timed.
    static constexpr size_t smallest_trial = 4 * smallest_batch;

    /// As Accelerator's.
    void intersect(std::span<const geometry::Ray> rays, std::span<geometry::Hit> hits);
    void is_occluded(std::span<const geometry::Ray> rays, std::span<uint8_t> occluded);

    bool has_chosen() const { return next_trial_ == last_trial; }

    bool is_side_by_side() const { return is_side_by_side_; }

  private:
    /// Batches that only warm the caches: while they are cold, rays side by side wait less.
    static constexpr size_t warm_up = 8;
    static constexpr size_t trials = 9;
    static constexpr size_t last_trial = warm_up + trials;

    // Each traces `count` rays from `first` on.
    template <class OneByOne, class SideBySide>
    void trace(size_t count, const OneByOne& one_by_one, const SideBySide& side_by_side);
    template <class OneByOne, class SideBySide>
    void try_both(size_t count, const OneByOne& one_by_one, const SideBySide& side_by_side);

    const Accelerator& accelerator_;
    bool is_side_by_side_ = false;
    size_t next_trial_ = 0;
    std::array<double, trials> gains_ = {};  ///< [trial] time one by one over time side by side
};

}  // namespace velatura::accel
