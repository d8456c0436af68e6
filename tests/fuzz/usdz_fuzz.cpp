// SPDX-License-Identifier: Apache-2.0
#include "base/package_path.h"
#include "base/zip_archive.h"
#include "usd/package/package.h"
#include "usd/text/reader.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <string_view>

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size);

/// Any bytes are a package or refused; its members lie within it, its root layer is read, and names
/// come out of their parts as they went in.
extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace velatura;
    const std::string_view text(reinterpret_cast<const char*>(data), size);
    const AssetBytesPtr bytes = make_asset_bytes(std::string(text));
    const std::string_view whole = bytes->bytes();
    if (const auto archive = ZipArchive::open(bytes, "fuzz.usdz")) {
        for (const ZipMember& member : (*archive)->members()) {
            const auto part = (*archive)->read(member);
            if (!part) continue;
            const std::string_view inner = (*part)->bytes();
            if (inner.data() < whole.data()) std::abort();
            if (inner.data() + inner.size() > whole.data() + whole.size()) std::abort();
        }
    }
    Diagnostics diagnostics;
    const auto root = usd::package::open_root_layer(bytes, "fuzz.usdz", diagnostics);
    if (root) {
        (void)usd::text::read_text_layer(root->bytes->bytes(), root->name, diagnostics).has_value();
    }
    const auto parts = split_package_path(text);
    if (parts.size() <= max_package_depth + 1 &&
        split_package_path(join_package_path(parts)) != parts) {
        std::abort();
    }
    return 0;
}
