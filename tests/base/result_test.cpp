// SPDX-License-Identifier: Apache-2.0
#include "base/result.h"

#include <gtest/gtest.h>

#include <memory>

namespace velatura {

namespace {

Result<int> half_of(int n) {
    if (n % 2 != 0) return Error{"odd", "cannot halve"};
    return n / 2;
}

TEST(Result, HoldsAValueOrAnError) {
    const Result<int> good = half_of(8);
    ASSERT_TRUE(good.has_value());
    EXPECT_EQ(*good, 4);
    const Result<int> bad = half_of(7);
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().code, "odd");
    EXPECT_EQ(bad.value_or(-1), -1);
    EXPECT_EQ(good.value_or(-1), 4);
}

TEST(Result, MovesWhatCannotBeCopied) {
    Result<std::unique_ptr<int>> made(std::make_unique<int>(5));
    const std::unique_ptr<int> taken = *std::move(made);
    EXPECT_EQ(*taken, 5);
}

TEST(Result, OfVoid) {
    EXPECT_TRUE(Result<void>().has_value());
    const Result<void> bad = Error{"io-write", "full"};
    ASSERT_FALSE(bad);
    EXPECT_EQ(bad.error().message, "full");
}

TEST(ResultDeathTest, AskingForWhatIsNotThereIsOurBug) {
    EXPECT_DEATH(half_of(7).value(), "without a value");
    EXPECT_DEATH(half_of(8).error(), "with a value");
}

}  // namespace

}  // namespace velatura
