// SPDX-License-Identifier: Apache-2.0
#include "usd/materialx/reader.h"
#include "usd/text/writer.h"

#include <cstddef>
#include <cstdint>
#include <string>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Any bytes are a document or refused, and the layer of a document can be written.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace velatura;
    const AssetBytesPtr bytes =
        make_asset_bytes(std::string(reinterpret_cast<const char*>(data), size));
    Diagnostics diagnostics;
    const auto layer = usd::materialx::read_materialx_layer(bytes, "fuzz.mtlx", diagnostics);
    if (layer) (void)usd::text::write_text_layer(**layer);
    return 0;
}
