// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "scene/ies_profile.h"
#include "translate/lights/ies_file.h"

#include <cmath>
#include <cstdlib>

namespace velatura::fuzz {

/// Any bytes are the profile of a lamp or refused; its light is finite in any direction, and in the
/// mean.
void ies(std::string_view bytes) {
    const auto profile = translate::lights::parse_ies(bytes);
    if (!profile) return;
    if (profile->vertical.size() < 2 ||
        profile->intensity.size() != profile->vertical.size() * profile->horizontal.size())
        std::abort();
    for (const double vertical : {0.0, 0.3, 1.5707963, 3.1415926535897931}) {
        for (const double horizontal : {-7.0, 0.0, 1.0, 3.2, 6.2831853, 100.0}) {
            const double value = scene::intensity(*profile, vertical, horizontal);
            if (!(value >= 0.0 && std::isfinite(value))) std::abort();
        }
    }
    const double mean = scene::mean_intensity(*profile);
    if (!(mean >= 0.0 && std::isfinite(mean))) std::abort();
}

}  // namespace velatura::fuzz
