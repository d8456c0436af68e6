// SPDX-License-Identifier: Apache-2.0
// Broken packages are refused or read, never more. $VELATURA_MUTATIONS: how many.
#include "base/zip_archive.h"
#include "stored_zip.h"
#include "usd/package/package.h"
#include "usd/text/reader.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <random>

namespace velatura::usd::package {
namespace {

using velatura::testing::append_u16;
using velatura::testing::append_u32;
using velatura::testing::stored_zip;

constexpr size_t usual_count = 4000;

size_t mutation_count() {
    const char* count = std::getenv("VELATURA_MUTATIONS");
    return count ? std::strtoull(count, nullptr, 10) : usual_count;
}

std::string seed_package() {
    const std::string layer =
        "#usda 1.0\ndef Mesh \"A\" {\n    point3f[] points = [(1, 2, 3)]\n}\n";
    const std::string inner = stored_zip({{"c.usda", layer}, {"t/b.png", "\x89PNG data"}});
    return stored_zip({{"b.usdz", inner}, {"d/a.usda", layer}, {"d/x.bin", std::string(200, 'x')}},
                      64, "comment");
}

/// One change of the kinds that break archives: bits, bytes, 16- and 32-bit numbers, cuts, copies.
void mutate(std::string& bytes, std::mt19937& random) {
    const auto below = [&](size_t n) { return size_t(random()) % n; };
    if (bytes.empty()) return;
    const size_t at = below(bytes.size());
    std::string number;
    constexpr size_t edges[] = {0,      1,          0x7f,       0xff,      0x7fff,
                                0xffff, 0x7fffffff, 0xfffffffe, 0xffffffff};
    switch (below(7)) {
        case 0:
            bytes[at] = char(bytes[at] ^ char(1u << below(8)));
            break;
        case 1:
            bytes[at] = char(below(256));
            break;
        case 2:
            append_u16(number, edges[below(9)]);
            bytes.replace(at, number.size(), number);
            break;
        case 3:
            append_u32(number, below(2) == 0 ? edges[below(9)] : below(bytes.size() + 8));
            bytes.replace(at, number.size(), number);
            break;
        case 4:
            bytes.resize(at);
            break;
        case 5:
            bytes.erase(at, below(64));
            break;
        default:
            bytes.insert(at, bytes.substr(below(bytes.size()), below(128)));
            break;
    }
}

/// Opens everything that can be had of a package; true when its root layer can be read.
bool read_all(const AssetBytesPtr& bytes) {
    Diagnostics diagnostics;
    const auto archive = ZipArchive::open(bytes, "mutated.usdz");
    if (archive) {
        for (const ZipMember& member : (*archive)->members()) {
            const auto data = (*archive)->read(member);
            if (!data) continue;
            // Every byte of a member lies within the file
            size_t sum = 0;
            for (const char c : (*data)->bytes()) sum += size_t(static_cast<unsigned char>(c));
            EXPECT_LE(sum, 255 * bytes->bytes().size());
            EXPECT_GE((*data)->bytes().data(), bytes->bytes().data());
            EXPECT_LE((*data)->bytes().data() + (*data)->bytes().size(),
                      bytes->bytes().data() + bytes->bytes().size());
        }
    }
    const auto root = open_root_layer(bytes, "mutated.usdz", diagnostics);
    if (!root) return false;
    return text::read_text_layer(root->bytes->bytes(), root->name, diagnostics).has_value();
}

TEST(PackageMutations, AreRefusedOrRead) {
    const std::string seed = seed_package();
    ASSERT_TRUE(read_all(make_asset_bytes(seed)));
    std::mt19937 random(20260101);
    const size_t count = mutation_count();
    size_t refused = 0;
    for (size_t i = 0; i < count; ++i) {
        std::string bytes = seed;
        for (size_t n = 1 + size_t(random()) % 3; n > 0; --n) mutate(bytes, random);
        refused += !read_all(make_asset_bytes(std::move(bytes)));
    }
    // Both sides are met: else the mutations say nothing
    EXPECT_GT(refused, count / 10);
    EXPECT_LT(refused, count - count / 50);
}

}  // namespace
}  // namespace velatura::usd::package
