// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/reader.h"
#include "usd/crate/writer.h"
#include "usd/text/writer.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Any bytes are read or refused; what is read is written, and what is written is read again and
/// prints the same.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace velatura;
    std::string bytes(reinterpret_cast<const char*>(data), size);
    Diagnostics diagnostics;
    const auto first =
        usd::crate::read_crate_layer(make_asset_bytes(std::move(bytes)), "fuzz.usdc", diagnostics);
    if (!first) return 0;
    const auto written = usd::crate::write_crate_layer(**first, diagnostics);
    if (!written) std::abort();
    const auto second =
        usd::crate::read_crate_layer(make_asset_bytes(*written), "written.usdc", diagnostics);
    if (!second || usd::text::write_text_layer(**first) != usd::text::write_text_layer(**second)) {
        std::abort();
    }
    return 0;
}
