// SPDX-License-Identifier: Apache-2.0
#include "crate_fixture.h"
#include "usd/crate/crate_format.h"
#include "usd/layer/fields.h"

#include <cstring>
#include <random>
#include <utility>
#include <vector>

namespace velatura::usd::crate {
namespace {

using layer::Path;

class CrateReader : public ::testing::Test {
  protected:
    LayerPtr read(const std::string& bytes) {
        bytes_ = make_asset_bytes(bytes);
        auto result = read_crate_layer(bytes_, "test.usdc", diagnostics_);
        if (!result) message_ = result.error().message;
        return result ? *result : nullptr;
    }

    const layer::Value& value(const layer::Layer& l, const char* path) {
        return *l.field(Path::from(path), layer::fields().default_value);
    }

    AssetBytesPtr bytes_;
    Diagnostics diagnostics_;
    std::string message_;
};

TEST_F(CrateReader, GivesTheLayerOfTheText) {
    const LayerPtr from_text = layer_of(every_kind);
    const LayerPtr from_crate = read(crate_of(*from_text));
    ASSERT_TRUE(from_crate) << message_;
    EXPECT_EQ(print(*from_crate), print(*from_text));
    EXPECT_EQ(from_crate->spec_count(), from_text->spec_count());
    // Not only in print: the same fields with equal values
    from_text->for_each_spec(Path::absolute_root(), [&](Path path, const layer::Spec& expected) {
        const layer::Spec* spec = from_crate->spec(path);
        ASSERT_TRUE(spec) << path.to_string();
        EXPECT_EQ(spec->kind(), expected.kind());
        ASSERT_EQ(spec->fields().size(), expected.fields().size()) << path.to_string();
        for (size_t i = 0; i < expected.fields().size(); ++i) {
            EXPECT_EQ(spec->fields()[i].name.str(), expected.fields()[i].name.str());
            EXPECT_TRUE(spec->fields()[i].value == expected.fields()[i].value)
                << path.to_string() << " " << expected.fields()[i].name.str();
        }
        EXPECT_TRUE(std::ranges::equal(spec->prim_children(), expected.prim_children()));
        EXPECT_TRUE(std::ranges::equal(spec->properties(), expected.properties()));
        EXPECT_TRUE(std::ranges::equal(spec->variants(), expected.variants()));
    });
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(CrateReader, KnowsTheFileButNoLine) {
    const LayerPtr l = read(crate_of(*layer_of("#usda 1.0\ndef \"A\" {\n int i = 1\n}\n")));
    ASSERT_TRUE(l);
    const SourceLoc loc = l->spec(Path::from("/A.i"))->field_loc(layer::fields().default_value);
    EXPECT_EQ(diagnostics_.file_name(loc.file_id), "test.usdc");
    EXPECT_EQ(loc.line, 0u);
}

TEST_F(CrateReader, LeavesPlainArraysInTheFile) {
    const LayerPtr l = read(crate_of(*layer_of(
        "#usda 1.0\ndef \"A\" {\n float3[] p = [(0.1, 0.2, 0.3), (4, 5, 6)]\n int[] few = [1, 2]\n"
        " int[] many = [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]\n}\n")));
    ASSERT_TRUE(l);
    const auto points = value(*l, "/A.p").as_array<layer::Vec3f>();
    const char* const begin = bytes_->bytes().data();
    const char* const end = begin + bytes_->bytes().size();
    const auto* at = reinterpret_cast<const char*>(points.data());
    EXPECT_TRUE(begin <= at && at < end);
    EXPECT_EQ(points[1], layer::Vec3f(4, 5, 6));
    at = reinterpret_cast<const char*>(value(*l, "/A.few").as_array<int32_t>().data());
    EXPECT_TRUE(begin <= at && at < end);
    const auto many = value(*l, "/A.many").as_array<int32_t>();
    ASSERT_EQ(many.size(), 17u);
    EXPECT_EQ(many[16], 17);
}

TEST_F(CrateReader, ValuesOutliveTheLayerAndTheCallersBytes) {
    layer::Value array;
    layer::TimeSamples samples;
    {
        LayerPtr l =
            read(crate_of(*layer_of("#usda 1.0\ndef \"A\" {\n float3[] p = [(0.1, 0.2, 0.3)]\n"
                                    " float x.timeSamples = { 1: 2, 3: None }\n}\n")));
        ASSERT_TRUE(l);
        array = value(*l, "/A.p");
        samples =
            *l->field_as<layer::TimeSamples>(Path::from("/A.x"), layer::fields().time_samples);
        l.reset();
        bytes_.reset();
    }
    EXPECT_EQ(array.as_array<layer::Vec3f>()[0].y, 0.2f);
    EXPECT_EQ(samples.value_at(1.0), layer::Value(2.0f));
    EXPECT_TRUE(samples.value_at(3.0).is_block());
}

TEST_F(CrateReader, ReadsEveryVersionSinceCompressionOfTables) {
    // 0.4 writes ranks of arrays, 0.5 compresses integers, 0.6 floats, 0.7 counts in 64 bits, 0.8
    // has payloads with offsets
    const LayerPtr text = layer_of(
        "#usda 1.0\ndef \"A\" (\n    payload = @p.usda@</P>\n)\n{\n"
        "    int[] many = [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]\n"
        "    double[] whole = [1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17]\n"
        "    point3f[] p = [(1, 2, 3)]\n    string[] s = [\"a\", \"b\"]\n}\n"
        "def \"B\" (\n    payload = None\n)\n{\n}\n");
    for (uint8_t minor = 4; minor <= 13; ++minor) {
        const std::string bytes = crate_of(*text, {Version{0, minor, 0}});
        EXPECT_EQ(bytes[9], char(minor));
        const LayerPtr l = read(bytes);
        ASSERT_TRUE(l) << message_;
        EXPECT_EQ(print(*l), print(*text)) << "version 0." << int(minor);
    }
}

/// A file whose tables are plain, as before 0.4: prim "/A" with a float "x" and a child "/A/B".
std::string plain_file(Version version) {
    const bool is_padded = version < Version{0, 1, 0};
    const auto put = [](std::string& out, auto value) {
        out.append(reinterpret_cast<const char*>(&value), sizeof value);
    };
    std::string file("PXR-USDC");
    file += {char(version.major_number), char(version.minor_number), char(version.patch_number)};
    file.resize(bootstrap_size, '\0');
    std::string contents;
    put(contents, uint64_t(6));
    const auto section = [&](std::string name, const std::string& bytes) {
        name.resize(16, '\0');
        contents += name;
        put(contents, uint64_t(file.size()));
        put(contents, uint64_t(bytes.size()));
        file += bytes;
    };
    std::string s;
    const std::vector<std::string> tokens = {
        "_",          "A",       "x",        "B",     "primChildren",
        "properties", "default", "typeName", "float", "specifier"};
    std::string text;
    for (const std::string& t : tokens) text += t + '\0';
    put(s, uint64_t(tokens.size()));
    put(s, uint64_t(text.size()));
    section("TOKENS", s + text);
    section("STRINGS", std::string(8, '\0'));
    // Lists of names of children
    std::vector<uint64_t> lists;
    for (const uint32_t name : {1u, 3u, 2u}) {
        lists.push_back(file.size());
        put(file, uint64_t(1));
        put(file, name);
    }
    const auto inlined = [](TypeId type, uint32_t bits) {
        return ValueRep::make(type, bits, ValueRep::inlined_bit).bits;
    };
    const std::vector<std::pair<uint32_t, uint64_t>> fields = {
        {4, ValueRep::make(TypeId::TokenVector, lists[0]).bits},
        {9, inlined(TypeId::Specifier, 0)},
        {4, ValueRep::make(TypeId::TokenVector, lists[1]).bits},
        {5, ValueRep::make(TypeId::TokenVector, lists[2]).bits},
        {7, inlined(TypeId::Token, 8)},
        {6, inlined(TypeId::Float, 0x3fc00000)},
    };
    s.clear();
    put(s, uint64_t(fields.size()));
    for (const auto& [token, value] : fields) {
        put(s, uint32_t(0));
        put(s, token);
        put(s, value);
    }
    section("FIELDS", s);
    s.clear();
    const std::vector<uint32_t> sets = {0, ~0u, 1, 2, 3, ~0u, 4, 5, ~0u, 1, ~0u};
    put(s, uint64_t(sets.size()));
    for (const uint32_t f : sets) put(s, f);
    section("FIELDSETS", s);
    // "/" has a child; "/A" has one; "/A/B" has a sibling, "/A.x"
    const auto entry = [&](uint32_t path, uint32_t token, uint32_t bits) {
        if (is_padded) put(s, uint32_t(0));
        put(s, path);
        put(s, token);
        put(s, bits);
    };
    s.clear();
    put(s, uint64_t(4));
    entry(0, 0, 1);
    entry(1, 1, 1);
    entry(2, 3, 2);
    entry(3, 2, 4);
    section("PATHS", s);
    s.clear();
    put(s, uint64_t(4));
    const uint32_t specs[][3] = {{0, 0, 7}, {1, 2, 6}, {2, 9, 6}, {3, 6, 1}};
    for (const auto& spec : specs) {
        if (is_padded) put(s, uint32_t(0));
        for (const uint32_t part : spec) put(s, part);
    }
    section("SPECS", s);
    const uint64_t at = file.size();
    std::memcpy(file.data() + 16, &at, sizeof at);
    return file + contents;
}

TEST_F(CrateReader, ReadsThePlainTablesOfOldVersions) {
    for (const Version version : {Version{0, 0, 1}, Version{0, 1, 0}, Version{0, 2, 0}}) {
        const LayerPtr l = read(plain_file(version));
        ASSERT_TRUE(l) << message_;
        EXPECT_EQ(
            print(*l),
            "#usda 1.0\n\ndef \"A\"\n{\n    float x = 1.5\n\n    def \"B\"\n    {\n    }\n}\n\n");
    }
    EXPECT_EQ(diagnostics_.all().size(), 0u);
}

TEST_F(CrateReader, NamesFileAndByteOfAnError) {
    EXPECT_FALSE(read("PXR-USDC"));
    EXPECT_EQ(message_, "test.usdc: found 8 bytes, expected the 88 of a header at byte 8");
    std::string bytes = crate_of(*layer_of(every_kind));
    EXPECT_FALSE(read(bytes.substr(0, bytes.size() - 1)));
    EXPECT_NE(message_.find("test.usdc: found "), std::string::npos);
    bytes[9] = 15;
    EXPECT_FALSE(read(bytes));
    EXPECT_EQ(message_,
              "test.usdc: found version 0.15.0, expected 0.0.1 to 0.14 without 0.3 at byte 8");
    bytes = crate_of(*layer_of(every_kind));
    const uint64_t far_away = bytes.size() + 5;
    std::memcpy(bytes.data() + 16, &far_away, sizeof far_away);
    EXPECT_FALSE(read(bytes));
    EXPECT_NE(message_.find("table of contents"), std::string::npos);
}

TEST_F(CrateReader, ReadsWhatHasNoSections) {
    // A header and an empty table of contents
    std::string bytes = "PXR-USDC";
    bytes += std::string("\0\x08\0", 3);
    bytes.resize(bootstrap_size + sizeof(uint64_t), '\0');
    bytes[16] = char(bootstrap_size);
    const LayerPtr l = read(bytes);
    ASSERT_TRUE(l) << message_;
    EXPECT_EQ(l->spec_count(), 1u);
}

TEST_F(CrateReader, ACorruptValueCostsThatValue) {
    const LayerPtr text =
        layer_of("#usda 1.0\ndef \"A\" {\n float3[] p = [(0.1, 0.2, 0.3)]\n float good = 2\n}\n");
    std::string bytes = crate_of(*text);
    // The count of the only array, in front of its first element
    const float first = 0.1f;
    std::string pattern(reinterpret_cast<const char*>(&first), sizeof first);
    const size_t at = bytes.find(pattern);
    ASSERT_NE(at, std::string::npos);
    bytes[at - 2] = '\x7f';
    const LayerPtr l = read(bytes);
    ASSERT_TRUE(l) << message_;
    EXPECT_FALSE(l->field(Path::from("/A.p"), layer::fields().default_value));
    EXPECT_EQ(value(*l, "/A.good"), layer::Value(2.0f));
    ASSERT_EQ(diagnostics_.error_count(), 1u);
    const Diagnostic d = diagnostics_.all()[0];
    EXPECT_EQ(d.prim_path, "/A.p");
    EXPECT_NE(d.message.find("at byte " + std::to_string(at - 8)), std::string::npos) << d.message;
}

TEST_F(CrateReader, DataFoundCorruptOnFirstUseIsReportedThen) {
    std::string text = "#usda 1.0\ndef \"A\" {\n int[] i = [";
    std::mt19937 random(1);
    for (int i = 0; i < 400; ++i) text += std::to_string(random() % 100000000) + ", ";
    std::string bytes = crate_of(*layer_of(text + "]\n}\n"));
    // Somewhere in the middle of the compressed array, which is what lies first
    std::memset(bytes.data() + bootstrap_size + 40, '\xff', 64);
    const LayerPtr l = read(bytes);
    ASSERT_TRUE(l) << message_;
    EXPECT_EQ(diagnostics_.error_count(), 0u);
    const auto integers = value(*l, "/A.i").as_array<int32_t>();
    ASSERT_EQ(integers.size(), 400u);
    EXPECT_EQ(integers[399], 0);
    EXPECT_EQ(diagnostics_.error_count(), 1u);
}

}  // namespace
}  // namespace velatura::usd::crate
