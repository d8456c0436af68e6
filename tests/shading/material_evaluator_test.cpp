// SPDX-License-Identifier: Apache-2.0
#include "shading/material_evaluator.h"

#include "geometry/tessellate.h"
#include "geometry/triangle_mesh.h"
#include "hard_case.h"
#include "image/exr.h"
#include "temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

namespace velatura::shading {
namespace {

using geometry::SurfacePoint;
using scene::Input;
using testing::TemporaryFolder;

/// A unit square in the xy plane, its st equal to its xy or (mirrored) to (x, −y), and a point on
/// it.
struct Stage {
    scene::Scene scene;
    geometry::TriangleMesh mesh;
    Diagnostics diagnostics;

    explicit Stage(bool is_mirrored = false) {
        scene::Shape shape;
        scene::Mesh m;
        m.points = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
        m.face_vertex_counts = {4};
        m.face_vertex_indices = {0, 1, 2, 3};
        scene::Primvar st;
        st.name = scene::intern_primvar(scene, "st");
        st.interpolation = scene::Interpolation::Vertex;
        st.width = 2;
        const float top = is_mirrored ? -1.0f : 1.0f;
        st.values = {0, 0, 1, 0, 1, top, 0, top};
        m.primvars.push_back(st);
        scene::Primvar color;
        color.name = scene::intern_primvar(scene, scene::display_color_primvar);
        color.width = 3;
        color.values = {0.1f, 0.2f, 0.3f};
        m.primvars.push_back(color);
        shape.geometry = m;
        mesh = geometry::make_triangle_mesh(shape);
        mesh.set_texture_coordinates(st.name);
        scene.materials.emplace_back();
    }

    scene::Material& material() { return scene.materials[0]; }

    SurfacePoint point(float b1 = 0.3f, float b2 = 0.3f) const {
        SurfacePoint p;
        p.mesh = &mesh;
        p.b1 = b1;
        p.b2 = b2;
        p.ng = p.ns = Vec3(0, 0, 1);
        p.material = 0;
        return p;
    }
};

const Vec3 up(0, 0, 1);

TEST(MaterialEvaluator, NoMaterialIsLambertOfDisplayColor) {
    Stage stage;
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    SurfacePoint p = stage.point();
    p.material = scene::none;
    const Bsdf bsdf = e.make_bsdf(p, up, 0);
    const Vec3 wi = normalize(Vec3(1, 2, 0.5f));
    EXPECT_NEAR(double(bsdf.f(up, wi).x), 0.1 / pi_d, 1e-7);
    EXPECT_NEAR(double(bsdf.f(up, wi).z), 0.3 / pi_d, 1e-7);
    EXPECT_FALSE(e.is_emissive(scene::none));
    EXPECT_TRUE(is_black(e.emission(p, up, 0)));
    EXPECT_EQ(e.presence(p, 0), 1.0f);
    EXPECT_FALSE(e.has_presence());
}

// A mesh that moves takes what a node graph makes of its place along
TEST(MaterialEvaluator, PatternsMoveWithTheirMesh) {
    Stage stage;
    geometry::TriangleMeshData data = std::move(stage.mesh).release();
    data.later_positions = {data.positions};
    for (Vec3& p : data.later_positions[0]) p += Vec3(3, 5, 7);
    stage.mesh = geometry::TriangleMesh(std::move(data));
    stage.scene.patterns.push_back({{{scene::PatternOp::Position, 3, {0, 0, 0, 0}, 1}}, {}});
    stage.material().has_specular = false;
    stage.material().diffuse_color.source = Input::Source::Pattern;
    stage.material().diffuse_color.pattern = 0;
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    SurfacePoint p = stage.point(0.25f, 0.5f);
    const Vec3 at_first = stage.mesh.corner(0, 0) * 0.25f + stage.mesh.corner(0, 1) * 0.25f +
                          stage.mesh.corner(0, 2) * 0.5f;
    for (const float time : {0.0f, 0.5f, 1.0f}) {
        p.time = time;
        p.p = at_first + Vec3(3, 5, 7) * time;
        EXPECT_EQ(e.make_bsdf(p, up, 0).albedo(), Rgb(at_first.x, at_first.y, at_first.z)) << time;
    }
}

// The specification's F0: ((1 − ior)/(1 + ior))², or the base color of metals, or specularColor
TEST(MaterialEvaluator, WorkflowsGiveTheirReflectanceAtNormalIncidence) {
    Stage stage;
    stage.material().diffuse_color = Input(Rgb(0.9f, 0.5f, 0.1f));
    stage.material().roughness = Input(0.0f);
    const auto mirror = [&] {
        const MaterialEvaluator e(stage.scene, stage.diagnostics);
        const Bsdf bsdf = e.make_bsdf(stage.point(), up, 0);
        // Delta lobes come last along u_lobe
        const auto s = bsdf.sample_f(up, 0x1.fffffep-1f, Vec2(0.5f, 0.5f));
        return s && s->is_delta ? s->f * bsdf.cosine(s->wi) : Rgb(-1.0f);
    };
    EXPECT_NEAR(double(mirror().x), 0.04, 1e-6);
    stage.material().ior = Input(2.0f);
    EXPECT_NEAR(double(mirror().x), 1.0 / 9, 1e-6);
    stage.material().metallic = Input(1.0f);
    EXPECT_NEAR(double(mirror().x), 0.9, 1e-6);
    EXPECT_NEAR(double(mirror().z), 0.1, 1e-6);
    stage.material().use_specular_workflow = true;
    stage.material().specular_color = Input(Rgb(0.3f, 0.2f, 0.1f));
    EXPECT_NEAR(double(mirror().y), 0.2, 1e-6);
}

// The lobe is long along ∂p/∂s, turned by the rotation, on both sides and on mirrored coordinates
TEST(MaterialEvaluator, AnisotropyFollowsTheTextureCoordinates) {
    for (const bool is_mirrored : {false, true}) {
        for (const float turns : {0.0f, 0.25f, 0.125f, -0.875f}) {
            Stage stage(is_mirrored);
            stage.material().diffuse_color = Input(Rgb(1.0f));
            stage.material().metallic = Input(1.0f);
            stage.material().anisotropy = Input(0.8f);
            stage.material().anisotropy_rotation = Input(turns);
            const MaterialEvaluator e(stage.scene, stage.diagnostics);
            for (const float side : {1.0f, -1.0f}) {
                const Vec3 wo = up * side;
                const Bsdf bsdf = e.make_bsdf(stage.point(), wo, 0);
                const double angle = 2 * pi_d * double(turns) * (is_mirrored ? -1.0 : 1.0);
                const Vec3 along(float(std::cos(angle)), float(std::sin(angle)), 0);
                const Vec3 across(-along.y, along.x, 0);
                const Vec3 a = normalize(wo + along * 0.5f), b = normalize(wo + across * 0.5f);
                EXPECT_GT(bsdf.f(wo, a).y, 2 * bsdf.f(wo, b).y) << turns << " " << side;
                const Vec3 diagonal = along + across, other = along - across;
                EXPECT_NEAR(double(bsdf.f(wo, normalize(wo + diagonal * 0.3f)).y /
                                   bsdf.f(wo, normalize(wo + other * 0.3f)).y),
                            1.0, 1e-4);
            }
        }
    }
}

TEST(MaterialEvaluator, AnisotropyWithoutCoordinatesHasAFixedDirection) {
    Stage stage;
    stage.mesh.set_texture_coordinates(scene::none);
    stage.material().metallic = Input(1.0f);
    stage.material().diffuse_color = Input(Rgb(1.0f));
    stage.material().anisotropy = Input(0.8f);
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    const Vec3 along = Frame::from_z(up).x, across = Frame::from_z(up).y;
    const Bsdf bsdf = e.make_bsdf(stage.point(), up, 0);
    EXPECT_GT(bsdf.f(up, normalize(up + along * 0.5f)).y,
              2 * bsdf.f(up, normalize(up + across * 0.5f)).y);
}

TEST(MaterialEvaluator, AbsorptionIsThatOfColorAndDepth) {
    Stage stage;
    stage.material().opacity = Input(0.0f);
    stage.material().roughness = Input(0.0f);
    stage.material().transmission_color = Input(Rgb(0.5f, 1.0f, 0.0f));
    stage.material().transmission_depth = 2.0f;
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    EXPECT_TRUE(e.has_absorption());
    EXPECT_TRUE(e.bounds_solid(0));
    EXPECT_NEAR(double(e.extinction(0).x), std::log(2.0) / 2, 1e-6);
    EXPECT_EQ(e.extinction(0).y, 0.0f);
    EXPECT_TRUE(std::isinf(e.extinction(0).z));
    // Then it does not tint the surface as well
    const auto passed = e.make_bsdf(stage.point(), up, 0).delta(ScatterKind::Transmit);
    ASSERT_TRUE(passed);
    EXPECT_NEAR(double(passed->weight.x), 0.96 / 2.25, 1e-6);
    stage.material().transmission_depth = 0.0f;
    const MaterialEvaluator tinted(stage.scene, stage.diagnostics);
    EXPECT_FALSE(tinted.has_absorption());
    EXPECT_NEAR(
        double(tinted.make_bsdf(stage.point(), up, 0).delta(ScatterKind::Transmit)->weight.x),
        0.48 / 2.25, 1e-6);
    EXPECT_FALSE(tinted.is_see_through());
    stage.material().thin_walled = true;
    stage.material().transmission_depth = 2.0f;
    const MaterialEvaluator thin(stage.scene, stage.diagnostics);
    EXPECT_FALSE(thin.has_absorption());
    EXPECT_FALSE(thin.bounds_solid(0));
    EXPECT_TRUE(thin.material_is_see_through(0));
    EXPECT_EQ(stage.diagnostics.all().size(), 0u);
    stage.material().thin_walled = false;
    stage.material().transmission_color.source = Input::Source::Primvar;
    const MaterialEvaluator varying(stage.scene, stage.diagnostics);
    EXPECT_EQ(stage.diagnostics.all().size(), 1u);
}

TEST(MaterialEvaluator, PaperTakesItsDiffuseColorWhereNoneIsGiven) {
    Stage stage;
    stage.material().has_specular = false;
    stage.material().diffuse_color = Input(Rgb(0.8f, 0.4f, 0.2f));
    stage.material().thin_walled = true;
    stage.material().diffuse_transmission = Input(0.25f);
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    EXPECT_TRUE(e.material_has_transmission(0));
    const Bsdf bsdf = e.make_bsdf(stage.point(), up, 0);
    EXPECT_NEAR(double(bsdf.f(up, up).y) * pi_d, 0.3, 1e-6);
    EXPECT_NEAR(double(bsdf.f(up, -up).y) * pi_d, 0.1, 1e-6);
    stage.material().thin_walled = false;
    const MaterialEvaluator body(stage.scene, stage.diagnostics);
    EXPECT_FALSE(body.material_has_transmission(0));
    EXPECT_NEAR(double(body.make_bsdf(stage.point(), up, 0).f(up, up).y) * pi_d, 0.4, 1e-6);
}

TEST(MaterialEvaluator, TexturesFollowStAndItsTransform) {
#ifndef VELATURA_HAVE_OPENIMAGEIO_PLUGIN
    GTEST_SKIP() << "built without the plugin openimageio";
#endif
    Stage stage;
    const TemporaryFolder folder;
    scene::Texture t;
    t.file = folder.file("xy.exr");
    image::Image xy;
    xy.data = xy.display = {0, 0, 2, 2};
    image::Part& part = xy.parts.emplace_back();
    for (const char* name : {"R", "G", "B"})
        part.channels.push_back(image::Channel::make(name, image::ChannelType::Float, 4));
    std::get<std::vector<float>>(part.channels[0].data) = {0.1f, 0.9f, 0.1f, 0.9f};
    std::get<std::vector<float>>(part.channels[1].data) = {0.9f, 0.9f, 0.1f, 0.1f};
    ASSERT_TRUE(image::write_exr(t.file, xy));
    t.colors.curve = scene::SourceColorSpace::Raw;
    t.wrap_s = t.wrap_t = scene::Wrap::Repeat;
    t.st = scene::find_primvar(stage.scene, "st");
    stage.scene.textures.push_back(t);
    Input input;
    input.source = Input::Source::Texture;
    input.texture = 0;
    stage.material().emissive_color = input;
    // Both triangles meet corner 0; find the point with st = (0.25, 0.75) by its primvar
    SurfacePoint p = stage.point();
    float st[4] = {};
    for (p.triangle = 0; p.triangle < 2; ++p.triangle) {
        for (const auto& [b1, b2] :
             {std::pair{0.25f, 0.5f}, std::pair{0.5f, 0.25f}, std::pair{0.25f, 0.25f}}) {
            p.b1 = b1;
            p.b2 = b2;
            ASSERT_TRUE(stage.mesh.primvar(t.st, p.triangle, b1, b2, st));
            const MaterialEvaluator e(stage.scene, stage.diagnostics);
            const Rgb c = e.emission(p, up, 0);
            if (st[0] == 0.25f) {
                EXPECT_NEAR(double(c.x), 0.1, 1e-5);
            }
            if (st[1] == 0.75f) {
                EXPECT_NEAR(double(c.y), 0.9, 1e-5);
            }
            // Half a turn of the coordinates exchanges the texels
            stage.scene.textures[0].st_matrix = {-1, 0, 0, -1};
            const MaterialEvaluator turned(stage.scene, stage.diagnostics);
            EXPECT_NEAR(double(turned.emission(p, up, 0).x) + double(c.x), 1.0, 1e-5);
            stage.scene.textures[0].st_matrix = {1, 0, 0, 1};
            // A footprint as large as the square sees the mean; one of a 256th sees what no
            // footprint sees
            EXPECT_NEAR(double(e.emission(p, up, 1.0f).x), 0.5, 0.01);
            const MaterialEvaluator sharp(stage.scene, stage.diagnostics, {}, -8.0f);
            const MaterialEvaluator blurred(stage.scene, stage.diagnostics, {}, 8.0f);
            EXPECT_EQ(sharp.emission(p, up, 1.0f), e.emission(p, up, 0x1p-8f));
            EXPECT_EQ(blurred.emission(p, up, 0x1p-8f), e.emission(p, up, 1.0f));
            EXPECT_EQ(blurred.emission(p, up, 0), c) << "no footprint is none, whatever the bias";
        }
    }
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    EXPECT_TRUE(e.is_emissive(0));
    EXPECT_TRUE(e.has_emission());
}

TEST(MaterialEvaluator, PresenceIsNotTransmission) {
    Stage stage;
    scene::Material& m = stage.material();
    const auto flags = [&] {
        const MaterialEvaluator e(stage.scene, stage.diagnostics);
        EXPECT_EQ(e.has_presence(), e.material_has_presence(0));
        return std::tuple(e.presence(stage.point(), 0), e.material_has_presence(0),
                          e.make_bsdf(stage.point(), up, 0).has_transmission());
    };
    EXPECT_EQ(flags(), std::tuple(1.0f, false, false));
    m.opacity = Input(0.4f);
    EXPECT_EQ(flags(), std::tuple(1.0f, false, true));
    m.presence = true;
    EXPECT_EQ(flags(), std::tuple(0.4f, true, false));
    m.presence = false;
    m.opacity_threshold = 0.5f;
    EXPECT_EQ(flags(), std::tuple(0.0f, true, false));
    m.opacity_threshold = 0.4f;  // at the threshold: fully visible
    EXPECT_EQ(flags(), std::tuple(1.0f, false, false));
}

// The specification: "the transmissive lobe (if any) always assumes roughness 0.0"; our own input
// changes that
TEST(MaterialEvaluator, RoughTransmissionIsAskedFor) {
    Stage stage;
    scene::Material& m = stage.material();
    m.opacity = Input(0.0f);
    m.roughness = Input(0.5f);
    const Vec3 below = normalize(Vec3(0.1f, 0, -1));
    const auto through = [&] {
        const MaterialEvaluator e(stage.scene, stage.diagnostics);
        return e.make_bsdf(stage.point(), up, 0).f(up, below).x;
    };
    EXPECT_EQ(through(), 0.0f);
    m.rough_transmission = true;
    EXPECT_GT(through(), 0.0f);
    m.roughness = Input(0.0f);
    EXPECT_EQ(through(), 0.0f);
    m.roughness = Input(0.5f);
    m.ior = Input(1.0f);
    EXPECT_EQ(through(), 0.0f);
    EXPECT_EQ(stage.diagnostics.warning_count(), 0u);
    // An index that varies over the surface has no table: said once, and transmitted as without
    m.ior.source = Input::Source::Primvar;
    m.ior.primvar = scene::find_primvar(stage.scene, "st");
    EXPECT_EQ(through(), 0.0f);
    EXPECT_EQ(stage.diagnostics.warning_count(), 1u);
}

TEST(H08Mirrored, NormalMapsTiltTowardsTheTangents) {
    Stage stage;
    stage.material().normal = Input(Rgb(0.6f, 0.0f, 0.8f));
    {
        const MaterialEvaluator e(stage.scene, stage.diagnostics);
        EXPECT_NEAR(double((e.make_bsdf(stage.point(), up, 0).ns() - Vec3(0.6f, 0, 0.8f)).length()),
                    0, 1e-6);
    }
    stage.material().normal = Input(Rgb(0.0f, 0.6f, 0.8f));
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    EXPECT_NEAR(double((e.make_bsdf(stage.point(), up, 0).ns() - Vec3(0, 0.6f, 0.8f)).length()), 0,
                1e-6);
    // Mirrored coordinates: green still points along ∂p/∂t
    Stage mirrored(true);
    mirrored.material().normal = Input(Rgb(0.0f, 0.6f, 0.8f));
    const MaterialEvaluator m(mirrored.scene, mirrored.diagnostics);
    hardcase::expect_within(
        {"normal of a map on mirrored coordinates",
         double((m.make_bsdf(mirrored.point(), up, 0).ns() - Vec3(0, -0.6f, 0.8f)).length()), 1e-6,
         0, "closed form"});
    // From behind, the normal is turned over as a whole
    EXPECT_NEAR(double((e.make_bsdf(stage.point(), -up, 0).ns() - Vec3(0, -0.6f, -0.8f)).length()),
                0, 1e-6);
}

TEST(MaterialEvaluator, NanInputsAreHarmless) {
    Stage stage;
    const float nan = std::nanf("");
    scene::Material& m = stage.material();
    m.diffuse_color = m.emissive_color = m.normal = Input(Rgb(nan));
    m.metallic = m.roughness = m.clearcoat = m.clearcoat_roughness = m.opacity = m.ior = Input(nan);
    const MaterialEvaluator e(stage.scene, stage.diagnostics);
    const Bsdf bsdf = e.make_bsdf(stage.point(), up, nan);
    EXPECT_TRUE(is_finite(bsdf.f(up, normalize(Vec3(1, 0, 1)))));
    EXPECT_TRUE(is_finite(bsdf.albedo()));
    EXPECT_TRUE(is_black(e.emission(stage.point(), up, nan)));
    EXPECT_GT(stage.diagnostics.warning_count(), 0u);
}

}  // namespace
}  // namespace velatura::shading
