// SPDX-License-Identifier: Apache-2.0
#include "selftest/checks.h"

#include "selftest/image_checks.h"
#include "selftest/number_checks.h"
#include "selftest/ray_checks.h"

namespace velatura::selftest {

std::span<const Check> checks() {
    static constexpr Check all[] = {
        {"H01", "Do rays slip through between adjacent triangles?", "none, as the mesh is closed",
         leaks},
        {"H02", "Do rays find the same hits as testing every triangle?",
         "a loop over all triangles", tree_against_loop},
        {"H03", "Do rays hit the surface that they leave?",
         "none, as a ray hits a flat triangle once", self_hits},
        {"H06", "Does the scale of a scene change its image?", "the unscaled image, bit for bit",
         scaled_image},
        {"H17", "Are directions transformed to the shading frame without loss?",
         "products in double", frames},
        {"H18", "Is the reflection of nearly perfect mirrors correct?",
         "the formula in long double", ggx_distribution},
        {"H20", "Do rough white metals reflect all light?", "the light that arrives", metal_energy},
        {"H22", "Do glass and water reflect what they should?", "Fresnel's formulas in long double",
         fresnel},
        {"H23", "Does smoke scatter light where it should?", "the requested mean cosine",
         scattering},
        {"H26", "Do lamps of any size and distance give the light they should?",
         "the closed form of their irradiance", sphere_lamps},
        {"H30", "Do MIS weights sum to one?", "a sum of 1", mis_weights},
        {"H31", "Is the light of every bounce there?", "the closed form of a closed room", furnace},
        {"H38", "Is the mean of many samples their mean?", "their sum in long double", sums},
        {"H43", "Are random numbers evenly spread and below 1?", "one point in each cell of a net",
         random_numbers},
        {"H51", "Do the light layers sum to the beauty?",
         "their sum in the order of the file, bit for bit", layers},
        {"H53", "Is the image the same with any number of threads?",
         "the image of one thread, bit for bit", threads},
    };
    return all;
}

}  // namespace velatura::selftest
