// SPDX-License-Identifier: Apache-2.0
// `render --cryptomatte` against counting what each sample meets.
#include "command.h"
#include "film/cryptomatte_decoder.h"
#include "image/exr.h"
#include "still_life.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <numeric>
#include <set>
#include <vector>

namespace velatura::test {

namespace {

constexpr int size = 40, samples = 12;

image::Image read(const Workplace& w, const std::string& name) {
    Result<image::Image> image = image::read_exr(w.path(name));
    if (!image) throw std::runtime_error(image.error().message);
    return std::move(*image);
}

class CryptomatteCommand : public testing::Test {
  protected:
    void SetUp() override { w.write("s.usda", still_life()); }

    image::Image render(const std::string& arguments, const std::string& output = "out.exr") {
        const CommandResult r = w.velatura(
            fmt::format("render s.usda --res {0} {0} --progress none -q --max-depth 2 -o {1} {2}",
                        size, output, arguments));
        EXPECT_EQ(r.exit_code, 0) << r.output;
        return read(w, output);
    }

    Workplace w;
};

double sum_of(const std::vector<float>& v) {
    return std::accumulate(v.begin(), v.end(), 0.0);
}

}  // namespace

TEST_F(CryptomatteCommand, IsWhatTheSamplesMeetOneByOne) {
    const std::string how = "--filter triangle ";
    const CryptomatteDecoder objects(
        render(how + fmt::format("--samples 0:{} --cryptomatte object", samples)), "CryptoObject");

    // One sample at a time: who is met, and by what instance
    std::map<uint64_t, std::vector<float>> met;
    for (int i = 0; i < samples; ++i) {
        const image::Image one =
            render(how + fmt::format("--layers data --samples {}:{}", i, i + 1));
        const image::Channel *prim = one.find("primId"), *instance = one.find("instanceId"),
                             *alpha = one.find("A");
        ASSERT_TRUE(prim && instance && alpha);
        for (size_t p = 0; p < prim->size(); ++p) {
            if (alpha->value(p) == 0.0f) continue;
            const uint32_t in = std::get<std::vector<uint32_t>>(instance->data)[p],
                           of = std::get<std::vector<uint32_t>>(prim->data)[p];
            std::vector<float>& counts = met[in == 0xffffffffu ? of : uint64_t(1) << 32 | in];
            counts.resize(prim->size());
            counts[p] += 1.0f;
        }
    }
    ASSERT_EQ(met.size(), objects.manifest.size());
    EXPECT_EQ(met.size(), 7u);
    std::set<uint64_t> found;
    for (const auto& [name, id] : objects.manifest) {
        std::vector<float> matte = objects.matte(name);
        for (float& m : matte) m = std::round(m * 1e4f);
        for (const auto& [key, counts] : met) {
            std::vector<float> expected = counts;
            for (float& c : expected) c = std::round(c / float(samples) * 1e4f);
            if (expected != matte) continue;
            EXPECT_TRUE(found.insert(key).second) << name << " is the second one";
        }
    }
    EXPECT_EQ(found.size(), met.size());
}

/// Components, and names that prims have: of instances, of the prims that place them.
TEST_F(CryptomatteCommand, AssetsAreWhatIsModeledAsAWhole) {
    w.write("assets.usda", R"usda(#usda 1.0
(
    subLayers = [@s.usda@]
)
over "W"
{
    over "First" (kind = "component")
    {
    }
    over "Proto" (kind = "component")
    {
    }
    over "Ball"
    {
        string primvars:crypto_asset = "toy"
    }
}
)usda");
    const CommandResult r = w.velatura(
        "render assets.usda -o assets.exr --res 40 40 --max-depth 2 --progress none --spp 4 -q "
        "--cryptomatte object,asset");
    ASSERT_EQ(r.exit_code, 0) << r.output;
    const image::Image image = *image::read_exr(w.path("assets.exr"));
    const CryptomatteDecoder objects(image, "CryptoObject"), assets(image, "CryptoAsset");
    std::vector<std::string> names;
    for (const auto& [name, id] : assets.manifest) names.push_back(name);
    EXPECT_EQ(names,
              (std::vector<std::string>{"/W/First", "/W/Proto", "/W/Second", "default", "toy"}));
    const auto expect_same = [](const std::vector<float>& a, const std::vector<float>& b) {
        ASSERT_EQ(a.size(), b.size());
        for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], 1e-6f) << i;
    };
    for (const char* instance : {"/W/First", "/W/Second"})
        expect_same(assets.matte(instance), objects.matte(instance));
    expect_same(assets.matte("toy"), objects.matte("/W/Ball"));
    std::vector<float> proto = objects.matte("/W/Proto/Body");
    const std::vector<float> head = objects.matte("/W/Proto/Head");
    for (size_t i = 0; i < proto.size(); ++i) proto[i] += head[i];
    expect_same(assets.matte("/W/Proto"), proto);
    expect_same(assets.total(), objects.total());
}

TEST_F(CryptomatteCommand, NamesAndAreasAreThoseOfTheScene) {
    const image::Image image = render("--filter box --spp 64 --cryptomatte object,material");
    const CryptomatteDecoder objects(image, "CryptoObject"), materials(image, "CryptoMaterial");
    std::vector<std::string> names;
    for (const auto& [name, id] : objects.manifest) names.push_back(name);
    EXPECT_EQ(names,
              (std::vector<std::string>{"/W/Ball", "/W/First", "/W/Proto/Body", "/W/Proto/Head",
                                        "/W/Second", "/W/Square", "/W/Veil_1"}));
    names.clear();
    for (const auto& [name, id] : materials.manifest) names.push_back(name);
    EXPECT_EQ(names, (std::vector<std::string>{"/W/Glass", "/W/Paint", "/W/Veil", "default"}));

    // Units are 10 pixels at the origin, 12.5 two units nearer
    const double veil = 1.3 * 1.2 * 12.5 * 12.5 * 0.25;
    EXPECT_NEAR(sum_of(objects.matte("/W/Veil_1")), veil, 0.01 * veil);
    EXPECT_NEAR(sum_of(materials.matte("/W/Veil")), veil, 0.01 * veil);
    // Of the square, a strip lies behind the veil: from the eye, up to 0.375 of its height
    const double square = 1.25 * (0.625 + 0.625 * 0.75) * 100;
    EXPECT_NEAR(sum_of(objects.matte("/W/Square")), square, 0.01 * square);
    // A ball seen from 10 units away along (0.9, 0.9): an ellipse, near enough a circle of r /
    // sqrt(1 - r^2/d^2)
    EXPECT_NEAR(sum_of(objects.matte("/W/Ball")), M_PI * 0.25 * 100, 0.03 * M_PI * 25);

    const std::vector<float> total = objects.total(), by_material = materials.total();
    const image::Channel* alpha = image.find("A");
    ASSERT_NE(alpha, nullptr);
    for (size_t i = 0; i < total.size(); ++i) {
        EXPECT_NEAR(total[i], alpha->value(i), 1e-6f) << i;
        EXPECT_NEAR(by_material[i], alpha->value(i), 1e-6f) << i;
    }
    const std::vector<float> unbound = materials.matte("default"),
                             head = objects.matte("/W/Proto/Head");
    for (size_t i = 0; i < total.size(); ++i) EXPECT_LE(head[i], unbound[i] + 1e-6f);
}

TEST_F(CryptomatteCommand, IsOneHoweverItWasMade) {
    const std::string how = "--filter mitchell --cryptomatte object,material --samples ";
    render(how + "0:40", "whole.exr");
    const std::string expected = w.hash("whole.exr");
    render(how + "0:40 --mode tile --tile 16 --threads 1", "tile.exr");
    EXPECT_EQ(w.hash("tile.exr"), expected);
    render(how + "0:18 --mode tile", "a.exr");
    render(how + "18:20 --threads 2", "b.exr");
    render(how + "20:40", "c.exr");
    const CommandResult merged = w.comp("merge c.exr a.exr b.exr -o merged.exr");
    ASSERT_EQ(merged.exit_code, 0) << merged.output;
    EXPECT_EQ(w.hash("merged.exr"), expected);
    const image::Image whole = read(w, "whole.exr"), joined = read(w, "merged.exr");
    for (const auto& [name, attribute] : whole.attributes) {
        if (!name.starts_with("cryptomatte/")) continue;
        EXPECT_EQ(joined.text(name), whole.text(name)) << name;
    }
    EXPECT_EQ(w.comp("verify merged.exr").exit_code, 0);
    // And a render that goes on from its file
    const std::string all = "--filter mitchell --cryptomatte object,material --spp ";
    render(all + "20 --resumable", "resumed.exr");
    render(all + "40 --resume", "resumed.exr");
    EXPECT_EQ(w.hash("resumed.exr"), expected);
    EXPECT_EQ(read(w, "resumed.exr").text("cryptomatte/3ae39a5/manifest"),
              whole.text("cryptomatte/3ae39a5/manifest"));
}

TEST_F(CryptomatteCommand, LeavesTheImageAlone) {
    render("--spp 4", "plain.exr");
    render("--spp 4 --cryptomatte object,material --cryptomatte-levels 2", "with.exr");
    const image::Image plain = read(w, "plain.exr"), with = read(w, "with.exr");
    EXPECT_NE(with.find("CryptoMaterial00.A"), nullptr);
    EXPECT_EQ(with.find("CryptoMaterial01.A"), nullptr);
    for (const image::Part& part : plain.parts) {
        for (const image::Channel& c : part.channels) {
            const image::Channel* other = with.find(c.name);
            ASSERT_NE(other, nullptr) << c.name;
            EXPECT_EQ(c.data, other->data) << c.name;
        }
    }
    const CommandResult wrong = w.velatura("render s.usda --cryptomatte objects");
    EXPECT_EQ(wrong.exit_code, 2);
    EXPECT_NE(wrong.output.find("--cryptomatte: expected object, material"), std::string::npos)
        << wrong.output;
}

}  // namespace velatura::test
