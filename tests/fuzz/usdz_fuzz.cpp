// SPDX-License-Identifier: Apache-2.0
#include "base/package_path.h"
#include "base/zip_archive.h"
#include "fuzz_targets.h"
#include "usd/package/package.h"
#include "usd/text/reader.h"

#include <cstdlib>
#include <string>
#include <string_view>

namespace velatura::fuzz {

/// Any bytes are a package or refused; its members lie within it, its root layer is read, and names
/// come out of their parts as they went in.
void usdz(std::string_view bytes) {
    const AssetBytesPtr file = make_asset_bytes(std::string(bytes));
    const std::string_view whole = file->bytes();
    if (const auto archive = ZipArchive::open(file, "fuzz.usdz")) {
        for (const ZipMember& member : (*archive)->members()) {
            const auto part = (*archive)->read(member);
            if (!part) continue;
            const std::string_view inner = (*part)->bytes();
            if (inner.data() < whole.data()) std::abort();
            if (inner.data() + inner.size() > whole.data() + whole.size()) std::abort();
        }
    }
    Diagnostics diagnostics;
    const auto root = usd::package::open_root_layer(file, "fuzz.usdz", diagnostics);
    if (root) {
        (void)usd::text::read_text_layer(root->bytes->bytes(), root->name, diagnostics).has_value();
    }
    const auto parts = split_package_path(bytes);
    if (parts.size() <= max_package_depth + 1 &&
        split_package_path(join_package_path(parts)) != parts) {
        std::abort();
    }
}

}  // namespace velatura::fuzz
