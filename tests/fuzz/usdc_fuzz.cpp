// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "usd/crate/reader.h"
#include "usd/crate/writer.h"
#include "usd/text/writer.h"

#include <cstdlib>
#include <string>

namespace velatura::fuzz {

/// Any bytes are read or refused; what is read is written, and what is written is read again and
/// prints the same.
void usdc(std::string_view bytes) {
    Diagnostics diagnostics;
    const auto first = usd::crate::read_crate_layer(make_asset_bytes(std::string(bytes)),
                                                    "fuzz.usdc", diagnostics);
    if (!first) return;
    const auto written = usd::crate::write_crate_layer(**first, diagnostics);
    if (!written) std::abort();
    const auto second =
        usd::crate::read_crate_layer(make_asset_bytes(*written), "written.usdc", diagnostics);
    if (!second || usd::text::write_text_layer(**first) != usd::text::write_text_layer(**second)) {
        std::abort();
    }
}

}  // namespace velatura::fuzz
