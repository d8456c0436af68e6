// SPDX-License-Identifier: Apache-2.0
#include "usd/text/reader.h"
#include "usd/text/writer.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Any bytes are read or refused; what is read is written, and what is written is read again and
/// written the same.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace velatura;
    const std::string_view bytes(reinterpret_cast<const char*>(data), size);
    Diagnostics diagnostics;
    const auto first = usd::text::read_text_layer(bytes, "fuzz.usda", diagnostics);
    if (!first) return 0;
    const std::string written = usd::text::write_text_layer(**first);
    const auto second = usd::text::read_text_layer(written, "written.usda", diagnostics);
    if (!second || usd::text::write_text_layer(**second) != written) std::abort();
    return 0;
}
