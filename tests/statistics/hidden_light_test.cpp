// SPDX-License-Identifier: Apache-2.0
// When an error that samples show is a lower bound, by light that they seldom find.
#include "statistics/hidden_light.h"

#include <gtest/gtest.h>

#include <cmath>

namespace velatura::statistics {

TEST(HiddenLight, MakesABoundOfWhatFewSamplesShow) {
    // One sample in 10,000 brings a relative square of 100: of 10⁶ samples 100 do, and the mean of
    // the squares is known to ±10 % (a deviation), twice that with 95 %
    const double rare = 1e-4, brings = 100;
    const HiddenLight light{rare * brings, rare * brings * brings};
    const double spp = 16, error = std::sqrt(light.square / spp);
    EXPECT_FALSE(hides_error(light, error, spp, 1.1e6 / spp));
    EXPECT_TRUE(hides_error(light, error, spp, 0.9e6 / spp));
    // An image that shows half of it, as it met few of them
    EXPECT_TRUE(hides_error(light, error / 2, spp, 0.9e6 / spp));
    // One that has so much noise besides that it does not matter
    EXPECT_FALSE(hides_error(light, 10 * error, spp, 0.9e6 / spp));
    EXPECT_FALSE(hides_error({}, 0.1, 16, 100)) << "there is none";
}

}  // namespace velatura::statistics
