// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/value.h"

#include "usd/layer/type_name.h"

#include <gtest/gtest.h>

#include <atomic>
#include <set>

namespace velatura::usd::layer {
namespace {

/// Brings its elements in on first use, as a mapped file would.
class LazyInts final : public ArrayData {
  public:
    explicit LazyInts(std::atomic<int>& loads) : loads_(loads) {}

    size_t size() const override { return 3; }

    const void* data() const override {
        ++loads_;
        return ints_;
    }

  private:
    std::atomic<int>& loads_;
    int32_t ints_[3] = {7, 8, 9};
};

TEST(Value, GivesBackExactlyWhatItHolds) {
    const Value v(Vec3f(1, 2, 3));
    ASSERT_NE(v.get_if<Vec3f>(), nullptr);
    EXPECT_EQ(*v.get_if<Vec3f>(), Vec3f(1, 2, 3));
    EXPECT_EQ(v.get_if<Vec3d>(), nullptr);
    EXPECT_TRUE(v.as_array<Vec3f>().empty());
    EXPECT_EQ(Value(std::string("text")).get_or<std::string>(""), "text");
    EXPECT_EQ(Value(5).get_or<double>(1.5), 1.5);
    EXPECT_TRUE(Value().is_empty());
    EXPECT_TRUE(Value::block().is_block());
    EXPECT_LE(sizeof(Value), 32u);
}

TEST(Value, CopiesShareLargeContent) {
    const Value a = Value::array<double>(std::vector<double>(1000, 2.0));
    const Value b = a;
    EXPECT_EQ(a.as_array<double>().data(), b.as_array<double>().data());
    Value c = std::move(const_cast<Value&>(b));
    EXPECT_EQ(c.as_array<double>().size(), 1000u);
    c = Value(Mat4d());
    c = a;
    c = Value(c);
    EXPECT_EQ(c, a);
}

TEST(Value, LoadsLazyArraysOnlyWhenAsked) {
    std::atomic<int> loads{0};
    const Value v = Value::array(ValueType::Int, std::make_shared<const LazyInts>(loads));
    EXPECT_EQ(v.array_size(), 3u);
    EXPECT_EQ(loads, 0);
    EXPECT_EQ(v.as_array<int32_t>()[2], 9);
    EXPECT_EQ(loads, 1);
}

TEST(Value, BoolArraysAreContiguous) {
    const Value v = Value::array<bool>({true, false, true});
    const std::span<const bool> bools = v.as_array<bool>();
    ASSERT_EQ(bools.size(), 3u);
    EXPECT_TRUE(bools[0] && !bools[1] && bools[2]);
}

TEST(Value, EqualityLooksIntoContent) {
    EXPECT_EQ(Value::array<int32_t>({1, 2}), Value::array<int32_t>({1, 2}));
    EXPECT_FALSE(Value::array<int32_t>({1, 2}) == Value::array<int32_t>({1, 3}));
    EXPECT_FALSE(Value(1) == Value(1.0));
    Dictionary a;
    a.entries["k"] = Value(Mat4d());
    Dictionary b = a;
    EXPECT_EQ(Value(a), Value(b));
    b.entries["k"] = Value(2);
    EXPECT_FALSE(Value(a) == Value(b));
}

TEST(Dictionary, MergesNested) {
    Dictionary strong_inner;
    strong_inner.entries["a"] = Value(1);
    Dictionary weak_inner;
    weak_inner.entries["a"] = Value(2);
    weak_inner.entries["b"] = Value(3);
    Dictionary strong;
    strong.entries["d"] = Value(strong_inner);
    Dictionary weak;
    weak.entries["d"] = Value(weak_inner);
    weak.entries["x"] = Value(4);
    const Dictionary merged = strong.merged_over(weak);
    const auto* inner = merged.find("d")->get_if<Dictionary>();
    ASSERT_NE(inner, nullptr);
    EXPECT_EQ(inner->find("a")->get_or(0), 1);
    EXPECT_EQ(inner->find("b")->get_or(0), 3);
    EXPECT_EQ(merged.find("x")->get_or(0), 4);
    EXPECT_EQ(merged.find("a"), nullptr);
}

TEST(TimeSamples, SortsAndLetsTheLastOfEqualTimesWin) {
    const TimeSamples s({{2.0, Value(2)}, {1.0, Value(1)}, {2.0, Value(3)}});
    ASSERT_EQ(s.size(), 2u);
    EXPECT_EQ(s.times()[0], 1.0);
    EXPECT_EQ(s.value_at(2.0).get_or(0), 3);
    EXPECT_TRUE(s.value_at(1.5).is_empty());
}

TEST(TypeName, KnowsEveryTypeOfTheStandard) {
    for (const char* name :
         {"bool",       "uchar",      "int",      "uint",           "int64",   "uint64",
          "half",       "float",      "double",   "timecode",       "string",  "token",
          "asset",      "opaque",     "group",    "pathExpression", "int2",    "half3",
          "float4",     "double2",    "point3f",  "point3h",        "color3f", "color4d",
          "texCoord2f", "texCoord3h", "normal3f", "vector3d",       "frame4d", "quath",
          "quatf",      "quatd",      "matrix2d", "matrix3d",       "matrix4d"}) {
        const TypeInfo* type = find_type(name);
        ASSERT_NE(type, nullptr) << name;
        EXPECT_EQ(type->name.str(), name);
        EXPECT_FALSE(type->is_array);
    }
    EXPECT_TRUE(find_type("color3f[]")->is_array);
    EXPECT_EQ(find_type("color3f[]")->type, ValueType::Float3);
    EXPECT_EQ(find_type("color3f[]")->role, Role::Color);
    EXPECT_EQ(find_type("Vec3f")->name.str(), "float3");
    EXPECT_EQ(find_type("Point[]")->name.str(), "point3d[]");
    EXPECT_EQ(find_type("opaque[]"), nullptr);
    EXPECT_EQ(find_type("nosuch"), nullptr);
    EXPECT_EQ(plain_type_name(Value::array<Vec3f>({})), "float3[]");
}

}  // namespace
}  // namespace velatura::usd::layer
