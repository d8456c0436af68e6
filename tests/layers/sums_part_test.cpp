// SPDX-License-Identifier: Apache-2.0
// Exact sums in a file: they come back as they were, and what cannot be right is refused, even
// where its digest is.
#include "layers/sums_part.h"

#include "accumulate/matte_sums.h"
#include "base/hash.h"
#include "layers/layer_header.h"
#include "layers/resolve.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace velatura::image {

namespace {

constexpr Window window{-3, 2, 20, 21};

accumulate::LayerSet some_set() {
    accumulate::LayerSet set;
    set.groups = {{"key", {"/key"}, false}, {"fill", {"/fill"}, false}};
    set.halves = true;
    set.mattes = {true, true};
    return set;
}

double number(uint64_t seed, uint64_t i) {
    return double(hash_combine(seed, i) >> 11) * 0x1p-53;
}

/// Pixels with ranges of several nodes, from other samples on, with no samples; many things in one
/// pixel. `is_later`: with samples that follow on these.
accumulate::SampleSums some_sums(bool is_later = false) {
    const accumulate::LayerSet set = some_set();
    accumulate::SampleSums sums(window, set);
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const uint64_t i = window.index(x, y), first = i % 3 + (is_later ? i % 12 : 0);
            const accumulate::PixelRecord record{.first = first,
                                                 .end = first + i % (is_later ? 7 : 12),
                                                 .prim_id = uint32_t(i),
                                                 .has_ids = i % 2 == 0,
                                                 .rate = uint8_t(i % 4)};
            const size_t nodes = accumulate::DyadicRule(first).nodes(first, record.end).size();
            std::vector<accumulate::NodeSums> list;
            for (const uint32_t a : {accumulate::AccumulatorTable::beauty,
                                     accumulate::AccumulatorTable::coverage, sums.table().bounce(1),
                                     sums.table().half_of(accumulate::AccumulatorTable::beauty)}) {
                accumulate::NodeSums one{a, {}};
                for (size_t n = 0; n < nodes; ++n)
                    one.nodes.push_back({number(a, 50 * i + n), 1.0, -number(a + 1, 50 * i + n)});
                list.push_back(std::move(one));
            }
            sums.append(x, y, record, list);
            if (record.end == first) continue;
            std::vector<accumulate::MatteWeight> things;
            for (uint32_t m = 0; m < i % 20; ++m)
                things.push_back({uint8_t(m % 2), 7 * m,
                                  m % 5 == 0 ? -accumulate::matte_weight(0.25)
                                             : accumulate::matte_weight(number(m, i) + 0.125)});
            accumulate::join_matte_weights(things);
            sums.mattes()->add(x, y, things);
        }
    }
    return sums;
}

Image image_of(const accumulate::SampleSums& sums) {
    Image image;
    image.data = image.display = window;
    image.parts = *layers::sums_parts(sums);
    image.attributes[layers::sums_attribute] = layers::sums_json(sums.layer_set(), image);
    return image;
}

Channel& channel(Image& image, const std::string& name) {
    for (Part& part : image.parts)
        for (Channel& c : part.channels)
            if (c.name == name) return c;
    ADD_FAILURE() << name;
    return image.parts[0].channels[0];
}

std::vector<uint32_t>& words(Image& image, const std::string& name) {
    return std::get<std::vector<uint32_t>>(channel(image, name).data);
}

/// What is refused though the digest is that of the damaged channels.
template <class Damage>
void expect_damaged(const char* why, const Damage& damage) {
    Image image = image_of(some_sums());
    damage(image);
    image.attributes[layers::sums_attribute] = layers::sums_json(some_set(), image);
    const auto read = layers::read_sums(image);
    ASSERT_FALSE(read.has_value()) << why;
    EXPECT_EQ(read.error().code, "sums-damaged") << why;
}

}  // namespace

TEST(SumsPart, ComesBackAsItWas) {
    const accumulate::SampleSums sums = some_sums();
    const auto back = layers::read_sums(image_of(sums));
    ASSERT_TRUE(back.has_value()) << back.error().message;
    EXPECT_EQ(back->layer_set(), sums.layer_set());
    EXPECT_EQ(back->used_accumulators(), sums.used_accumulators());
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const accumulate::PixelRecord &a = sums.record(x, y), &b = back->record(x, y);
            ASSERT_EQ(a.first, b.first);
            ASSERT_EQ(a.end, b.end);
            ASSERT_EQ(a.prim_id, b.prim_id);
            ASSERT_EQ(a.has_ids, b.has_ids);
            ASSERT_EQ(a.rate, b.rate);
            for (const uint32_t accumulator : sums.used_accumulators()) {
                for (size_t n = 0; n < sums.nodes_of(x, y).size(); ++n)
                    ASSERT_EQ(sums.node_sum(x, y, accumulator, n),
                              back->node_sum(x, y, accumulator, n));
            }
            ASSERT_EQ(sums.mattes()->at(x, y), back->mattes()->at(x, y));
        }
    }
    const auto records = layers::stored_records(image_of(sums));
    ASSERT_TRUE(records.has_value());
    for (size_t i = 0; i < records->size(); ++i)
        EXPECT_EQ((*records)[i].end - (*records)[i].first, i % 12);
}

/// Straight from the files, as from sums that were read before.
TEST(SumsPart, AppendsThoseOfLaterSamples) {
    accumulate::SampleSums expected = some_sums();
    const accumulate::SampleSums later = some_sums(true);
    expected.append(later);
    auto sums = layers::empty_sums(image_of(some_sums()), some_sums().window());
    ASSERT_TRUE(sums.has_value());
    ASSERT_TRUE(layers::append_sums(image_of(some_sums()), *sums).has_value());
    ASSERT_TRUE(layers::append_sums(image_of(later), *sums).has_value());
    EXPECT_EQ(layers::sums_json(sums->layer_set(), image_of(*sums)),
              layers::sums_json(expected.layer_set(), image_of(expected)));
    EXPECT_EQ(sums->record(0, 5).end, expected.record(0, 5).end);
    // What does not follow
    EXPECT_EQ(layers::append_sums(image_of(later), *sums).error().code, "sums-damaged");
    const auto records = layers::stored_records(image_of(later));
    ASSERT_TRUE(records.has_value());
    for (int y = window.y0; y < window.y1; ++y) {
        for (int x = window.x0; x < window.x1; ++x) {
            const accumulate::PixelRecord& record = (*records)[window.index(x, y)];
            ASSERT_EQ(record.first, later.record(x, y).first);
            ASSERT_EQ(record.end, later.record(x, y).end);
            ASSERT_EQ(record.rate, later.record(x, y).rate);
        }
    }
}

/// A digest over strips is that of the whole, of whatever height they are.
TEST(SumsPart, DigestsDoNotDependOnStrips) {
    const Image whole = image_of(some_sums());
    const std::string stated = whole.text(layers::sums_attribute);
    for (const int rows : {1, 5, 16, 19}) {
        for (const int changed : {-1, 0, 18}) {
            layers::SumsDigest digest(whole.data);
            for (int y = 0; y < window.height(); y += rows) {
                Image strip = whole;
                strip.data.y0 = window.y0 + y;
                strip.data.y1 = std::min(strip.data.y0 + rows, window.y1);
                for (Part& part : strip.parts) {
                    for (Channel& c : part.channels) {
                        auto& words = std::get<std::vector<uint32_t>>(c.data);
                        const auto begin = words.begin() + y * window.width();
                        words = std::vector<uint32_t>(begin,
                                                      begin + strip.data.height() * window.width());
                        if (c.name == "sums_primId" && changed >= y && changed < y + rows)
                            ++words[size_t((changed - y) * window.width())];
                    }
                }
                digest.add(strip);
            }
            EXPECT_EQ(digest.is_that_of(stated), changed < 0) << rows << " " << changed;
        }
    }
}

TEST(SumsPart, SumsOfAnotherVersionAreRefusedByName) {
    Image image = image_of(some_sums());
    std::string text = image.text(layers::sums_attribute);
    const size_t at = text.find("velatura.sums/2");
    ASSERT_NE(at, std::string::npos);
    image.attributes[layers::sums_attribute] = text.replace(at, 15, "velatura.sums/1");
    EXPECT_EQ(layers::read_sums(image).error().code, "sums-version");
}

TEST(SumsPart, HasTheChannelsOfItsContract) {
    Image image = image_of(some_sums());
    for (const char* name :
         {"sums_first", "sums_end", "sums_invalid", "sums_primId", "sums_instanceId", "sums_hasIds",
          "sums_rate", "sums0_0.x1", "sums1_1.y1", "sums_matte0.kind", "sums_matte18.w1"})
        EXPECT_NE(image.find(name), nullptr) << name;
}

TEST(SumsPart, RefusesWhatCannotBe) {
    const auto add = [](const std::string& name) {
        return [name](Image& image) {
            image.parts[0].channels.push_back(
                Channel::make(name, ChannelType::Uint, window.pixel_count()));
        };
    };
    const auto drop = [](const std::string& name) {
        return [name](Image& image) {
            for (Part& part : image.parts)
                std::erase_if(part.channels, [&](const Channel& c) { return c.name == name; });
        };
    };
    for (const char* name : {"sums_end", "sums_hasIds", "sums_matte0.id", "sums_matte3.w1"})
        expect_damaged(name, drop(name));
    // Nodes, accumulators and words that there are not, and what is no number at all
    for (const char* name : {"sums64_0.x0", "sums99999999999_0.x0", "sums0_100000.x0",
                             "sums0_4294967296.x0", "sums0_0.x2", "sums0_0.", "sums0_0",
                             "sums_other", "sums-1_0.x0", "sums", "sums_matte99.kind"})
        expect_damaged(name, add(name));
    for (const char* name : {"sums_first", "sums_rate", "sums0_0.x1", "sums_matte0.w0"}) {
        expect_damaged("as floats", [&](Image& image) {
            channel(image, name).data = std::vector<float>(window.pixel_count());
        });
        expect_damaged("too few", [&](Image& image) { words(image, name).pop_back(); });
    }
    expect_damaged("an end before the beginning", [](Image& image) {
        words(image, "sums_end")[40] = 0;
        words(image, "sums_first")[40] = 1;
    });
    // Of a pixel with 15 things and 11 samples
    expect_damaged("a kind that there is not",
                   [](Image& image) { words(image, "sums_matte0.kind")[35] = 256; });
    expect_damaged("a weight of too many samples",
                   [](Image& image) { words(image, "sums_matte0.w1")[35] = 0x7fffffff; });
    expect_damaged("more of them than fit together", [](Image& image) {
        // Eight times the samples of the pixel each, of sixteen times at most
        for (const char* name : {"sums_matte0.", "sums_matte1."}) {
            words(image, name + std::string("kind"))[35] = 1;
            words(image, name + std::string("w0"))[35] = 0;
            words(image, name + std::string("w1"))[35] = 2;
        }
    });
    expect_damaged("a negative one",
                   [](Image& image) { words(image, "sums_matte0.w1")[35] = 0x80000000; });
}

/// What --rates-from reads: the records alone, with a digest of their own.
TEST(SumsPart, RecordsNeedNoSumsBesideThem) {
    Image image = image_of(some_sums());
    ASSERT_EQ(image.parts.size(), 2u);
    for (const Channel& c : image.parts[0].channels) EXPECT_TRUE(layers::is_record(c.name));
    for (const Channel& c : image.parts[1].channels) EXPECT_FALSE(layers::is_record(c.name));
    image.parts.pop_back();
    const auto records = layers::stored_records(image);
    ASSERT_TRUE(records.has_value()) << records.error().message;
    EXPECT_EQ((*records)[3].rate, 3);
    EXPECT_TRUE(layers::are_records_intact(image));
    Image other = image;
    words(other, "sums_rate")[5] ^= 1;
    EXPECT_FALSE(layers::are_records_intact(other));
    other = image;
    words(other, "sums_first")[5] = 9;
    words(other, "sums_end")[5] = 8;
    EXPECT_EQ(layers::stored_records(other).error().code, "sums-damaged");
    other = image;
    words(other, "sums_end").pop_back();
    EXPECT_EQ(layers::stored_records(other).error().code, "sums-damaged");
}

TEST(SumsPart, RefusesLayerSetsWithMoreAccumulatorsThanNumbers) {
    accumulate::LayerSet set = some_set();
    set.caster_layers = set.shadow_layers = set.matrix_layers = true;
    for (int i = 0; i < 9; ++i) {
        for (int k = 0; k < 7000; ++k) {
            set.groups.push_back({"g", {}, false});
            set.casters.push_back({"c", ""});
        }
    }
    EXPECT_EQ(accumulate::LayerSet::from_json(set.to_json()).error().code, "layer-set-json");
    set.casters.resize(100);
    EXPECT_TRUE(accumulate::LayerSet::from_json(set.to_json()).has_value());
}

}  // namespace velatura::image
