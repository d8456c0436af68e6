// SPDX-License-Identifier: Apache-2.0
// What a decoder may answer: anything.
#include "plugins/openimageio/sandbox/messages.h"

#include "base/hash.h"
#include "plugins/openimageio/sandbox/shared_memory.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstring>

namespace velatura::plugins::openimageio {
namespace {

const Request request = {.kind = RequestKind::ReadLines, .serial = 77};
const std::string area(1000, 'a');

std::string bytes(const Reply& reply) {
    return {reinterpret_cast<const char*>(&reply), sizeof reply};
}

/// Why it is refused, or its length.
std::string judged(const Reply& reply, const PayloadSize& size = {600, 600}) {
    const Result<size_t> length = payload_length(request, size, bytes(reply), area);
    return length ? std::to_string(*length) : length.error().code + ": " + length.error().message;
}

TEST(Reply, IsTheAnswerToItsRequestAndOfTheLengthAskedFor) {
    EXPECT_EQ(judged({.serial = 77, .bytes = 600}), "600");
    EXPECT_EQ(judged({.serial = 77, .bytes = 5}, {0, 1000}), "5");
    EXPECT_EQ(judged({.serial = 76, .bytes = 600}), "reader-answer: it answers another request");
    EXPECT_EQ(judged({.serial = 77, .bytes = 599}),
              "reader-answer: it has another size than requested");
    EXPECT_EQ(judged({.serial = 77, .bytes = 601}),
              "reader-answer: it has another size than requested");
    EXPECT_EQ(judged({.serial = 77, .bytes = 1001}, {0, size_t(-1)}),
              "reader-answer: it is longer than the area");
    EXPECT_EQ(judged({.serial = 77, .bytes = uint64_t(-1)}, {0, size_t(-1)}),
              "reader-answer: it is longer than the area");
    EXPECT_EQ(judged({.version = 9, .serial = 77, .bytes = 600}),
              "reader-answer: it is of another version");
    EXPECT_EQ(judged({.status = ReplyStatus(0), .serial = 77, .bytes = 600}),
              "reader-answer: it is neither yes nor no");
    EXPECT_EQ(judged({.status = ReplyStatus::Refused, .serial = 77, .bytes = 3}),
              "image-read: aaa");
    const std::string whole = bytes({.serial = 77, .bytes = 600});
    for (size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(payload_length(request, {600, 600}, whole.substr(0, size), area));
    EXPECT_FALSE(payload_length(request, {600, 600}, whole + "x", area));
}

SourceSpec some_spec() {
    SourceSpec spec;
    spec.levels.resize(3);
    for (LevelSpec& level : spec.levels) level.width = level.channels = 5;
    spec.levels[1].stored = StoredAs::Half;
    spec.color_space = "sRGB";
    spec.wrap_t = "mirror";
    spec.rows_per_strip = 8;
    return spec;
}

TEST(Spec, SurvivesItsBytes) {
    const SourceSpec spec = some_spec();
    const Result<SourceSpec> read = spec_of(spec_bytes(spec));
    ASSERT_TRUE(read);
    EXPECT_EQ(*read, spec);
}

TEST(Spec, CutOrLongerOnesAreRefused) {
    const std::string whole = spec_bytes(some_spec());
    for (size_t size = 0; size < whole.size(); ++size)
        EXPECT_FALSE(spec_of(std::string_view(whole).substr(0, size))) << size;
    EXPECT_FALSE(spec_of(whole + '\0'));
    EXPECT_FALSE(spec_of(std::string("\xff\xff\xff\x7f", 4) + whole.substr(4)));
    SourceSpec none = some_spec();
    none.levels.clear();
    EXPECT_FALSE(spec_of(spec_bytes(none)));
}

/// Wrong bytes give another spec, which is its own bytes again, or none.
TEST(Spec, MutantsAreSpecsOrRefused) {
    const std::string whole = spec_bytes(some_spec());
    size_t read = 0;
    for (uint64_t seed = 0; seed < 20000; ++seed) {
        std::string mutant = whole;
        for (uint64_t i = 0; i <= seed % 3; ++i) {
            const uint64_t dice = mix64(seed * 3 + i + 1);
            mutant[dice % mutant.size()] = char(dice >> 32);
        }
        const Result<SourceSpec> spec = spec_of(mutant);
        if (!spec) continue;
        ++read;
        ASSERT_EQ(spec_bytes(*spec), mutant);
    }
    EXPECT_GT(read, 1000u);
    EXPECT_LT(read, 19000u);
}

/// A page that is gone would end the process that looks at it.
TEST(SharedMemory, IsNeverShortened) {
    Result<SharedMemory> mine = SharedMemory::create();
    ASSERT_TRUE(mine);
    ASSERT_TRUE(mine->reserve(10000));
    EXPECT_LT(::ftruncate(mine->descriptor(), 0), 0);
    SharedMemory other{FileDescriptor(::dup(mine->descriptor()))};
    EXPECT_FALSE(other.map(20000));
    ASSERT_TRUE(other.map(10000));
    other.bytes()[9999] = 'x';
    EXPECT_EQ(mine->text()[9999], 'x');
    mine->forget_beyond(4096);
    EXPECT_EQ(mine->text()[9999], '\0');
    ASSERT_TRUE(mine->reserve(30000));
    EXPECT_EQ(mine->bytes().size(), 30000u);
}

TEST(PlainReason, HasNoControlCharactersAndIsUtf8) {
    EXPECT_EQ(plain_reason("a\nb\x1b[0m\n \n"), "a b [0m");
    EXPECT_EQ(plain_reason("\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80"),
              "\xc3\xa4\xe2\x82\xac\xf0\x9f\x98\x80");
    // Cut, overlong, a surrogate, beyond Unicode, a control character of two bytes
    EXPECT_EQ(plain_reason("x\xc3"), "x");
    EXPECT_EQ(plain_reason("\xc0\xaf"
                           "x"),
              "  x");
    EXPECT_EQ(plain_reason("\xe0\x80\xafx"), "   x");
    EXPECT_EQ(plain_reason("\xed\xa0\x80x"), "   x");
    EXPECT_EQ(plain_reason("\xf4\x90\x80\x80x"), "    x");
    EXPECT_EQ(plain_reason("\xc2\x9bx"), "  x");
    EXPECT_EQ(plain_reason(std::string(5000, 'x')).size(), max_reason_bytes);
}

}  // namespace
}  // namespace velatura::plugins::openimageio
