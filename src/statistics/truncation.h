// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "accumulate/sample_sums.h"

#include <optional>

namespace velatura::statistics {

/// The light of paths that a limit on scatterings cut off, as a share of all light of the image.
struct TruncatedLight {
    double share = 0;
    double low = 0, high = 0;  ///< 95 % interval, with what the last bounces leave open of the fall
};

/// Goes on with the fall of the bounce layers as a geometric series: what bounce n + 1 and later
/// ones would bring is A_n r / (1 − r), with the ratio r of the last stored bounces or, where they
/// end before the limit, of the tail. Exact in a closed solid of one albedo. Returns: none if too
/// few bounces were kept one by one, or if they do not fall.
std::optional<TruncatedLight> truncated_light(const accumulate::SampleSums& sums, int max_depth);

}  // namespace velatura::statistics
