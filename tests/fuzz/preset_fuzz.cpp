// SPDX-License-Identifier: Apache-2.0
#include "compositor/look/controls.h"
#include "fuzz_targets.h"

#include <cstdlib>
#include <string>

namespace velatura::fuzz {

/// Any bytes are a preset or refused; what is read is written, read again and written the same, and
/// is a look at any frame.
void preset(std::string_view bytes) {
    using namespace compositor;
    const Result<Look> look = look_from_json(std::string(bytes));
    if (!look) return;
    const std::string written = look_to_json(*look);
    const Result<Look> again = look_from_json(written);
    if (!again || look_to_json(*again) != written || !look_differences(*look, *again).empty())
        std::abort();
    for (const double frame : {-1e9, 0.0, 1.5, 1e9}) {
        for (const Control& c : look_at(*look, frame).controls)
            for (const float factor : c.factor)
                if (!(factor >= 0.0f && factor <= largest_factor)) std::abort();
    }
}

}  // namespace velatura::fuzz
