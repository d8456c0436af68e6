// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <cstdlib>
#include <string>
#include <string_view>

namespace velatura::fuzz {

/// Any bytes are read or refused; what is read is written, and what is written is read again and
/// written the same.
void usda(std::string_view bytes) {
    Diagnostics diagnostics;
    const auto first = usd::text::read_text_layer(bytes, "fuzz.usda", diagnostics);
    if (!first) return;
    const std::string written = usd::text::write_text_layer(**first);
    const auto second = usd::text::read_text_layer(written, "written.usda", diagnostics);
    if (!second || usd::text::write_text_layer(**second) != written) std::abort();
}

}  // namespace velatura::fuzz
