// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accel/bvh.h"
#include "accel/traverse.h"
#include "brute_force.h"
#include "compare.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <vector>

namespace velatura::accel::test {

/// The tree finds what testing every triangle finds, with every instruction set.
inline void expect_exact(const SoupScene& scene,
                         const std::vector<geometry::Ray>& rays,
                         size_t min_hits,
                         BvhOptions options = {}) {
    const std::vector<geometry::Hit> expected = hits_of(BruteForce(scene), rays);
    for (const Kernels& kernels : all_kernels()) {
        options.kernels = &kernels;
        const auto bvh = build_bvh(scene, options);
        const Agreement agreement = compare(*bvh, expected, rays);
        EXPECT_EQ(agreement.different, 0u) << kernels.name << " of " << agreement.rays << " rays";
        EXPECT_EQ(agreement.different_occlusion, 0u) << kernels.name;
        EXPECT_GE(agreement.hits, min_hits);
    }
}

}  // namespace velatura::accel::test
