// SPDX-License-Identifier: Apache-2.0
// What a file says of itself is still said of what is made from it, and nothing else.
#include "compositor/denoise/denoise.h"
#include "compositor/io/merge.h"
#include "compositor/made_layers.h"
#include "compositor/mix/mix.h"
#include "compositor/mix/mix_job.h"
#include "compositor/test_stack.h"
#include "image/exr.h"
#include "layers/layer_file.h"

#include <OpenEXR/ImfBoxAttribute.h>
#include <OpenEXR/ImfChannelList.h>
#include <OpenEXR/ImfDoubleAttribute.h>
#include <OpenEXR/ImfFloatAttribute.h>
#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfHeader.h>
#include <OpenEXR/ImfMatrixAttribute.h>
#include <OpenEXR/ImfMultiPartInputFile.h>
#include <OpenEXR/ImfOutputFile.h>
#include <OpenEXR/ImfRationalAttribute.h>
#include <OpenEXR/ImfStandardAttributes.h>
#include <OpenEXR/ImfStringAttribute.h>
#include <OpenEXR/ImfStringVectorAttribute.h>
#include <OpenEXR/ImfVecAttribute.h>
#include <gtest/gtest.h>

#include <set>

namespace velatura::compositor::mix {
namespace {

using enum Control::Kind;

std::string path_of(const std::string& name) {
    return film::temporary_file("carried_" + name);
}

/// One of every kind that a production has.
void add_attributes(Imf::Header& header) {
    Imf::addTimeCode(header, Imf::TimeCode(16, 10, 10, 20));
    Imf::addKeyCode(header, Imf::KeyCode(1, 2, 3, 4, 5));
    Imf::addOwner(header, "studio");
    Imf::addComments(header, "take 3");
    Imf::addCapDate(header, "2024:01:01 00:00:00");
    Imf::addFramesPerSecond(header, Imf::Rational(24000, 1001));
    header.insert("shutter", Imf::RationalAttribute(Imf::Rational(1, 48)));
    header.insert("lens/distortion", Imf::V3fAttribute(Imath::V3f(0.1f, 0.2f, 0.3f)));
    header.insert("crop", Imf::Box2iAttribute(Imath::Box2i({1, 2}, {3, 4})));
    header.insert("prod/shots", Imf::StringVectorAttribute({"sh010", "sh020"}));
    header.insert("nuke/x", Imf::DoubleAttribute(1.5));
    header.insert("camera", Imf::M33fAttribute(Imath::M33f(1, 2, 3, 4, 5, 6, 7, 8, 9)));
    header.screenWindowWidth() = 1.5f;
}

/// Every attribute as its type and bytes, by OpenEXR alone.
std::map<std::string, std::string> attributes_of(const std::string& path) {
    const Imf::MultiPartInputFile file(path.c_str());
    std::map<std::string, std::string> all;
    for (auto a = file.header(0).begin(); a != file.header(0).end(); ++a) {
        Imf::Header one;
        one.insert("value", a.attribute());
        all[a.name()] = a.attribute().typeName();
        if (const auto* t = dynamic_cast<const Imf::TimeCodeAttribute*>(&a.attribute()))
            all[a.name()] += std::to_string(t->value().timeAndFlags());
        if (const auto* s = dynamic_cast<const Imf::StringAttribute*>(&a.attribute()))
            all[a.name()] += s->value();
        if (const auto* r = dynamic_cast<const Imf::RationalAttribute*>(&a.attribute()))
            all[a.name()] += std::to_string(r->value().n) + "/" + std::to_string(r->value().d);
        if (const auto* v = dynamic_cast<const Imf::StringVectorAttribute*>(&a.attribute()))
            for (const std::string& s : v->value()) all[a.name()] += s + ";";
        if (const auto* m = dynamic_cast<const Imf::M33fAttribute*>(&a.attribute()))
            for (int i = 0; i < 9; ++i) all[a.name()] += std::to_string(m->value()[i / 3][i % 3]);
        if (const auto* f = dynamic_cast<const Imf::FloatAttribute*>(&a.attribute()))
            all[a.name()] += std::to_string(f->value());
    }
    return all;
}

std::string foreign_file() {
    const std::string path = path_of("foreign.exr");
    Imf::Header header(8, 8);
    add_attributes(header);
    std::vector<float> values(64, 0.5f);
    Imf::FrameBuffer buffer;
    for (const char* c : {"R", "G", "B", "key.R", "key.G", "key.B"}) {
        header.channels().insert(c, Imf::Channel(Imf::FLOAT));
        buffer.insert(c, Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(values.data()), 4, 32));
    }
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(8);
    return path;
}

TEST(Carried, AMixSaysAllThatItsFileSaysAndNothingElse) {
    const std::string path = foreign_file(), mixed = path_of("mixed.exr");
    MixJob job;
    job.look = look_of({{Gain, "key=2"}});
    ASSERT_TRUE(mix_one(job, {path}, mixed, {}, 1).has_value());
    const auto before = attributes_of(path), after = attributes_of(mixed);
    for (const auto& [name, value] : before) {
        if (name == "channels" || name == "compression") continue;
        ASSERT_TRUE(after.count(name)) << name;
        EXPECT_EQ(after.at(name), value) << name;
    }
    // Beside those, only what the mix says of its layers
    std::set<std::string> added;
    for (const auto& [name, value] : after) {
        if (before.count(name) == 0) added.insert(name);
    }
    EXPECT_EQ(added,
              (std::set<std::string>{"velatura/closure", "velatura/layers", "velatura/lights",
                                     "velatura/mix", "velatura/samples"}));
}

/// An attribute of a type that nobody knows.
TEST(Carried, TypesThatAreNotKnownKeepTheirBytes) {
    image::Image image = made_foreign({{"", {"R", "G", "B"}}});
    const image::OtherAttribute secret{"hal9000", std::string("\0\1\2\xff odd", 8)};
    image.attributes["studio/secret"] = secret;
    const std::string path = path_of("unknown.exr"), mixed = path_of("unknown_mixed.exr");
    ASSERT_TRUE(layers::write_image_file(path, image).has_value());
    ASSERT_TRUE(mix_one({}, {path}, mixed, {}, 1).has_value());
    const auto reader = image::ExrReader::open(mixed);
    ASSERT_TRUE(reader.has_value());
    const auto at = reader->header().attributes.find("studio/secret");
    ASSERT_NE(at, reader->header().attributes.end());
    EXPECT_EQ(at->second, image::Attribute(secret));
}

TEST(Carried, WhatDescribesPixelsThatAreGoneGoesWithThem) {
    image::Attributes attributes = {{"owner", std::string("x")},
                                    {"cryptomatte/0000000/name", std::string("y")},
                                    {"velatura/plan", std::string("{}")},
                                    {"preview", image::OtherAttribute{"preview", "12345678"}}};
    EXPECT_EQ(layers::carried_attributes(attributes),
              (image::Attributes{{"owner", std::string("x")}}));
}

/// Of a render: attributes that another program added after it.
image::Image tagged(const std::string& path) {
    auto image = layers::read_layer_file(path);
    EXPECT_TRUE(image.has_value());
    image->attributes["owner"] = std::string("studio");
    image->attributes["timeCode"] =
        image::OtherAttribute{"timecode", std::string("\1\2\3\4\0\0\0\0", 8)};
    return std::move(*image);
}

void expect_tags(const image::Image& image) {
    EXPECT_EQ(image.text("owner"), "studio");
    EXPECT_EQ(image.attributes.count("timeCode"), 1u);
    EXPECT_EQ(image.attributes.count("worldToCamera"), 1u);
}

TEST(Carried, DenoiseMixAndMergeKeepTags) {
    film::LayerSet set = film::test_layer_set();
    set.matrix_layers = set.halves = true;
    std::vector<std::string> parts;
    for (const auto& [name, first, end] : {std::tuple{"a", 0, 2}, {"b", 2, 4}}) {
        film::Film film({0, 0, 20, 17}, set);
        film::render(film, uint64_t(first), uint64_t(end));
        film::FileInfo info;
        info.store_sums = true;
        const std::string path = path_of(std::string(name) + ".exr");
        ASSERT_TRUE(film.write(path, info).has_value());
        ASSERT_TRUE(layers::write_image_file(path, tagged(path)).has_value());
        parts.push_back(path);
    }
    const auto stack = LayerStack::load(parts[0]);
    ASSERT_TRUE(stack.has_value());
    denoise::DenoiseReport report;
    const auto denoised = denoise::denoise(*stack, report);
    ASSERT_TRUE(denoised.has_value()) << denoised.error().message;
    expect_tags(*denoised);
    expect_tags(apply_mix(*stack, *plan_mix(*stack, {}), {}, true));
    const std::string merged = path_of("merged.exr");
    MergeReport merge_report;
    ASSERT_TRUE(merge_files(parts, merged, {}, merge_report).has_value());
    expect_tags(*layers::read_layer_file(merged));
}

/// 2 × 3e38 is beyond 3.4e38: a gain that overflows is told, and refused where that is asked for.
TEST(Numbers, GainsBeyondFloatsAreToldAndRefusedWhenStrict) {
    image::Image image = made_foreign({{"", {"R", "G", "B", "key.R", "key.G", "key.B"}}});
    for (image::Channel& c : image.parts[0].channels) {
        if (c.name == "key.G") std::get<std::vector<float>>(c.data)[40] = 3e38f;
    }
    const std::string path = path_of("large.exr"), mixed = path_of("large_mixed.exr");
    ASSERT_TRUE(image::write_exr(path, image).has_value());
    MixJob job;
    job.look = look_of({{Gain, "key=8"}});
    const auto warnings = mix_one(job, {path}, mixed, {}, 1);
    ASSERT_TRUE(warnings.has_value());
    ASSERT_EQ(warnings->size(), 1u);
    EXPECT_NE((*warnings)[0].find("1 values of the mix exceed the range of floats (the first at "
                                  "pixel 3,1) and are infinite"),
              std::string::npos)
        << (*warnings)[0];
    job.is_strict = true;
    const auto refused = mix_one(job, {path}, path_of("strict.exr"), {}, 1);
    ASSERT_FALSE(refused.has_value());
    EXPECT_EQ(refused.error().code, "not-finite");
}

}  // namespace
}  // namespace velatura::compositor::mix
