// SPDX-License-Identifier: Apache-2.0
#include "fuzz_targets.h"
#include "usd/materialx/reader.h"
#include "usd/text/writer.h"

#include <string>

namespace velatura::fuzz {

/// Any bytes are a document or refused, and the layer of a document can be written.
void mtlx(std::string_view bytes) {
    Diagnostics diagnostics;
    const auto layer = usd::materialx::read_materialx_layer(make_asset_bytes(std::string(bytes)),
                                                            "fuzz.mtlx", diagnostics);
    if (layer) (void)usd::text::write_text_layer(**layer);
}

}  // namespace velatura::fuzz
