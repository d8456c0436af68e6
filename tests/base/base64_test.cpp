// SPDX-License-Identifier: Apache-2.0
#include "base/base64.h"

#include <gtest/gtest.h>

namespace velatura {
namespace {

TEST(Base64, IsThatOfRfc4648) {
    EXPECT_EQ(to_base64(""), "");
    EXPECT_EQ(to_base64("M"), "TQ==");
    EXPECT_EQ(to_base64("Ma"), "TWE=");
    EXPECT_EQ(to_base64("Man"), "TWFu");
}

TEST(Base64, ComesBackAsTheBytes) {
    std::string bytes;
    for (int i = 0; i < 256; ++i) {
        bytes += char(i * 7);
        EXPECT_EQ(from_base64(to_base64(bytes)), bytes) << i;
    }
}

}  // namespace
}  // namespace velatura
