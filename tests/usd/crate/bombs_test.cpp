// SPDX-License-Identifier: Apache-2.0
// Files whose few bytes stand for more memory than there is: refused before any of it is taken.
#include "base/process/memory_limit.h"
#include "crate_fixture.h"
#include "usd/crate/crate_format.h"
#include "usd/layer/fields.h"
#include "value_table.h"

#include <fmt/format.h>

#include <cstring>
#include <functional>
#include <optional>

namespace velatura::usd::crate {
namespace {

using layer::Path;

void append(std::string& bytes, uint64_t number) {
    bytes.append(reinterpret_cast<const char*>(&number), sizeof number);
}

class CrateBombs : public ::testing::Test {
  protected:
    /// A crate of `count` arrays of ints, of which the i-th has what `stored` gives instead.
    static std::string bomb(int count, const std::function<std::string(int)>& stored) {
        std::string text = "#usda 1.0\ndef \"A\" {\n float good = 2\n";
        for (int i = 0; i < count; ++i) {
            text += fmt::format(" int[] a{} = [{}", i, i);
            for (int k = 0; k < 20; ++k) text += ", 7";
            text += "]\n";
        }
        std::string bytes = crate_of(*layer_of(text + "}\n"));
        std::optional<ValueTable> values = ValueTable::of(bytes);
        int changed = 0;
        for (size_t i = 0; i < values->size(); ++i) {
            const ValueRep old{(*values)[i]};
            if (!old.is_array() || old.type() != TypeId::Int) continue;
            const uint64_t flags = old.bits & ~ValueRep::payload_mask;
            values->set(i, flags | bytes.size());
            bytes += stored(changed++);
        }
        EXPECT_EQ(changed, count);
        values->append_to(bytes);
        return bytes;
    }

    /// Reads it, and what else it holds; how many of its arrays are left.
    static int arrays_read(const std::string& bytes, Diagnostics& diagnostics) {
        const size_t before = peak_resident_bytes();
        const auto read = read_crate_layer(make_asset_bytes(bytes), "bomb.usdc", diagnostics);
        EXPECT_LT(peak_resident_bytes(), before + (size_t(64) << 20))
            << "taken for what is refused";
        if (!read) {
            ADD_FAILURE() << read.error().message;
            return -1;
        }
        EXPECT_EQ(*(*read)->field(Path::from("/A.good"), layer::fields().default_value),
                  layer::Value(2.0f));
        int count = 0;
        for (int i = 0; i < 8; ++i) {
            const Path path = Path::from(fmt::format("/A.a{}", i));
            count += (*read)->field(path, layer::fields().default_value) ? 1 : 0;
        }
        return count;
    }
};

/// Ints that are all 0, as LZ4 of LZ4's best case: `n` of them in about n / 1020 bytes.
std::string zeros(uint64_t n) {
    // The most common difference, then two bits for each
    const std::string codes(sizeof(int32_t) + n / 4, '\0');
    std::string compressed;
    compress(codes, compressed);
    std::string stored;
    append(stored, n);
    append(stored, compressed.size());
    return stored + compressed;
}

TEST_F(CrateBombs, CountsThatTheBytesCannotHold) {
    for (const uint64_t n : {uint64_t(1) << 30, uint64_t(1) << 40, uint64_t(1) << 62, UINT64_MAX}) {
        Diagnostics diagnostics;
        const std::string real = zeros(1000);
        const std::string bytes = bomb(2, [&](int i) {
            std::string stored = real;
            if (i == 1) std::memcpy(stored.data(), &n, sizeof n);
            return stored;
        });
        EXPECT_EQ(arrays_read(bytes, diagnostics), 1) << n;
        ASSERT_EQ(diagnostics.error_count(), 1u) << n;
        EXPECT_NE(diagnostics.all()[0].message.find(fmt::format("found {} elements in", n)),
                  std::string::npos)
            << diagnostics.all()[0].message;
    }
}

TEST_F(CrateBombs, WhatTheyStandForTogetherIsLimited) {
    // Each is half a gigabyte, and honest about it
    constexpr uint64_t n = uint64_t(1) << 27;
    const std::string stored = zeros(n);
    EXPECT_LT(stored.size(), n * sizeof(int32_t) / 4000);
    const std::string bytes = bomb(8, [&](int) { return stored; });
    // 1 GiB, and 1,024 bytes for each byte of the file, another gigabyte
    const auto allowed = int(((uint64_t(1) << 30) + 1024 * bytes.size()) / (n * sizeof(int32_t)));
    EXPECT_LT(allowed, 5);
    Diagnostics diagnostics;
    EXPECT_EQ(arrays_read(bytes, diagnostics), allowed);
    EXPECT_EQ(diagnostics.error_count(), size_t(8 - allowed));
    EXPECT_NE(diagnostics.all()[0].message.find("limit reached"), std::string::npos);
}

}  // namespace
}  // namespace velatura::usd::crate
