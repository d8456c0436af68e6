// SPDX-License-Identifier: Apache-2.0
#include "import/import.h"

#include "translate/translate.h"
#include "usd/stage/stage.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace velatura::import {

namespace {

namespace fs = std::filesystem;

const fs::path files = fs::path(VELATURA_SOURCE_DIR) / "tests/import";

std::string text_of(const fs::path& file) {
    std::stringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

/// A folder that vanishes with the test.
class Import : public testing::Test {
  protected:
    Import() {
        std::string pattern = (fs::temp_directory_path() / "velatura_import_XXXXXX").string();
        folder_ = mkdtemp(pattern.data());
    }

    ~Import() override { fs::remove_all(folder_); }

    Result<ImportSummary> run(const fs::path& file) {
        return import_file(file.string(), output().string(), diagnostics_);
    }

    fs::path output() const { return folder_ / "out.usda"; }

    size_t count(const std::string& code) const {
        const auto all = diagnostics_.all();
        return size_t(std::count_if(all.begin(), all.end(),
                                    [&](const Diagnostic& d) { return d.code == code; }));
    }

    usd::stage::Stage open(const fs::path& file) {
        auto stage = usd::stage::Stage::open(file.string(), {}, diagnostics_);
        EXPECT_TRUE(stage.has_value()) << file;
        for (const Diagnostic& d : diagnostics_.all())
            if (d.severity == Severity::Error) ADD_FAILURE() << diagnostics_.format(d);
        return *stage;
    }

    scene::Scene translate(const fs::path& file) {
        auto scene = translate::translate_stage(open(file), {}, diagnostics_);
        EXPECT_TRUE(scene.has_value()) << (scene ? "" : scene.error().message);
        return scene ? *std::move(scene) : scene::Scene();
    }

    fs::path folder_;
    Diagnostics diagnostics_;
};

/// A mesh where it stands, with what it looks like.
struct Placed {
    std::vector<Vec3> points;
    std::vector<uint32_t> counts, indices;
    std::vector<Vec3> normals;      ///< [corner]
    std::vector<float> st, colors;  ///< [corner]
    bool is_double_sided = false;
    const scene::Material* material = nullptr;
};

/// Row of the numbers of a corner.
size_t row_at(const scene::Mesh& mesh,
              scene::Interpolation interpolation,
              const std::vector<uint32_t>& indices,
              size_t corner) {
    const bool is_by_corner = interpolation == scene::Interpolation::FaceVarying;
    EXPECT_TRUE(is_by_corner || interpolation == scene::Interpolation::Vertex);
    const size_t element = is_by_corner ? corner : mesh.face_vertex_indices[corner];
    return indices.empty() ? element : indices[element];
}

/// Numbers of a primvar, corner after corner.
std::vector<float> primvar(const scene::Scene& scene, const scene::Mesh& mesh, const char* name) {
    std::vector<float> out;
    for (const scene::Primvar& p : mesh.primvars) {
        if (scene.primvar_names[p.name] != name) continue;
        for (size_t c = 0; c < mesh.face_vertex_indices.size(); ++c)
            for (size_t k = 0; k < p.width; ++k)
                out.push_back(p.values[row_at(mesh, p.interpolation, p.indices, c) * p.width + k]);
    }
    return out;
}

void add_shape(const scene::Scene& scene,
               const scene::Shape& shape,
               const Mat4& matrix,
               std::vector<Placed>& out) {
    const auto& mesh = std::get<scene::Mesh>(shape.geometry);
    Placed placed;
    for (const Vec3& p : mesh.points) placed.points.push_back(transform_point(p, matrix));
    placed.counts = mesh.face_vertex_counts;
    placed.indices = mesh.face_vertex_indices;
    const Mat4 normal_matrix = matrix.inverse().transposed();
    for (size_t c = 0; c < mesh.face_vertex_indices.size() && !mesh.normals.empty(); ++c) {
        const size_t row = row_at(mesh, mesh.normal_interpolation, mesh.normal_indices, c);
        Vec3 turned;
        normal_matrix.multDirMatrix(mesh.normals[row], turned);
        placed.normals.push_back(turned.normalized());
    }
    placed.st = primvar(scene, mesh, "st");
    placed.colors = primvar(scene, mesh, "displayColor");
    placed.is_double_sided = shape.double_sided;
    if (shape.material != scene::none) placed.material = &scene.materials[shape.material];
    out.push_back(std::move(placed));
}

/// Every mesh of the scene, instances too, in the order of their centers.
std::vector<Placed> placed_meshes(const scene::Scene& scene) {
    std::vector<Placed> out;
    for (const scene::Shape& shape : scene.shapes) add_shape(scene, shape, Mat4(), out);
    for (const scene::Instance& instance : scene.instances)
        for (const scene::Shape& shape : scene.prototypes[instance.prototype].shapes)
            add_shape(scene, shape, instance.render_from_prototype, out);
    const auto center = [](const Placed& p) {
        Vec3 sum(0.0f);
        for (const Vec3& q : p.points) sum += q;
        return sum / float(p.points.size());
    };
    std::sort(out.begin(), out.end(), [&](const Placed& a, const Placed& b) {
        const Vec3 x = center(a), y = center(b);
        return std::array{std::round(x.x * 64), std::round(x.y * 64), std::round(x.z * 64)} <
               std::array{std::round(y.x * 64), std::round(y.y * 64), std::round(y.z * 64)};
    });
    return out;
}

void expect_near(const Vec3& a, const Vec3& b, float tolerance) {
    EXPECT_NEAR(a.x, b.x, tolerance);
    EXPECT_NEAR(a.y, b.y, tolerance);
    EXPECT_NEAR(a.z, b.z, tolerance);
}

template <class T>
void expect_near(const T& a, const T& b, float tolerance) {
    ASSERT_EQ(a.size(), b.size());
    for (size_t i = 0; i < a.size(); ++i) EXPECT_NEAR(a[i], b[i], tolerance);
}

void expect_like(const scene::Scene& a,
                 const scene::Input& x,
                 const scene::Scene& b,
                 const scene::Input& y,
                 const char* name) {
    SCOPED_TRACE(name);
    ASSERT_EQ(x.source, y.source);
    if (x.source != scene::Input::Source::Texture) expect_near(Vec3(x.value), Vec3(y.value), 1e-5f);
    if (x.source == scene::Input::Source::Primvar) {
        EXPECT_EQ(a.primvar_names[x.primvar], b.primvar_names[y.primvar]);
    }
    if (x.source != scene::Input::Source::Texture) return;
    EXPECT_EQ(x.output, y.output);
    const scene::Texture &s = a.textures[x.texture], &t = b.textures[y.texture];
    EXPECT_EQ(s.wrap_s, t.wrap_s);
    EXPECT_EQ(s.wrap_t, t.wrap_t);
    EXPECT_EQ(s.colors.curve, t.colors.curve);
    expect_near(s.scale, t.scale, 1e-6f);
    expect_near(s.bias, t.bias, 1e-6f);
    expect_near(s.st_matrix, t.st_matrix, 1e-5f);
    EXPECT_NEAR(s.st_offset.x, t.st_offset.x, 1e-5f);
    EXPECT_NEAR(s.st_offset.y, t.st_offset.y, 1e-5f);
}

void expect_like(const scene::Scene& a,
                 const scene::Material& x,
                 const scene::Scene& b,
                 const scene::Material& y) {
    SCOPED_TRACE(x.name);
    expect_like(a, x.diffuse_color, b, y.diffuse_color, "diffuse");
    expect_like(a, x.emissive_color, b, y.emissive_color, "emissive");
    expect_like(a, x.specular_color, b, y.specular_color, "specular");
    expect_like(a, x.metallic, b, y.metallic, "metallic");
    expect_like(a, x.roughness, b, y.roughness, "roughness");
    expect_like(a, x.clearcoat, b, y.clearcoat, "clearcoat");
    expect_like(a, x.clearcoat_roughness, b, y.clearcoat_roughness, "clearcoat roughness");
    expect_like(a, x.opacity, b, y.opacity, "opacity");
    expect_like(a, x.ior, b, y.ior, "ior");
    expect_like(a, x.normal, b, y.normal, "normal");
    EXPECT_EQ(x.use_specular_workflow, y.use_specular_workflow);
    EXPECT_EQ(x.opacity_threshold, y.opacity_threshold);
    EXPECT_EQ(x.presence, y.presence);
}

/// What a light does from afar: radiance times area, or radiance where it has no size.
Vec3 strength(const scene::Light& light) {
    const bool is_sphere = light.kind == scene::LightKind::Sphere;
    return Vec3(light.Le) * (is_sphere ? pi * light.radius * light.radius : 1.0f);
}

void expect_like(const scene::Light& x, const scene::Light& y) {
    SCOPED_TRACE(x.name);
    EXPECT_EQ(x.kind, y.kind);
    const Vec3 a = strength(x), b = strength(y);
    expect_near(a, b, 2e-5f * std::max({b.x, b.y, b.z}));
    EXPECT_TRUE(x.render_from_light.equalWithAbsError(y.render_from_light, 1e-4));
    EXPECT_NEAR(x.shaping.cone_angle_deg, y.shaping.cone_angle_deg, 1e-4f);
    EXPECT_NEAR(x.shaping.cone_softness, y.shaping.cone_softness, 1e-5f);
    EXPECT_EQ(x.shaping.is_active, y.shaping.is_active);
}

/// The imported scene and its twin, numerically: `unit` is a length that counts as one.
void expect_like(const scene::Scene& a, const scene::Scene& b, float unit) {
    const auto x = placed_meshes(a), y = placed_meshes(b);
    ASSERT_EQ(x.size(), y.size());
    for (size_t i = 0; i < x.size(); ++i) {
        ASSERT_EQ(x[i].counts, y[i].counts);
        ASSERT_EQ(x[i].indices.size(), y[i].indices.size());
        for (size_t c = 0; c < x[i].indices.size(); ++c)
            expect_near(x[i].points[x[i].indices[c]], y[i].points[y[i].indices[c]], 2e-6f * unit);
        ASSERT_EQ(x[i].normals.size(), y[i].normals.size());
        for (size_t c = 0; c < x[i].normals.size(); ++c)
            expect_near(x[i].normals[c], y[i].normals[c], 1e-5f);
        expect_near(x[i].st, y[i].st, 1e-6f);
        expect_near(x[i].colors, y[i].colors, 1e-6f);
        EXPECT_EQ(x[i].is_double_sided, y[i].is_double_sided);
        ASSERT_TRUE(x[i].material != nullptr && y[i].material != nullptr);
        expect_like(a, *x[i].material, b, *y[i].material);
    }
    ASSERT_EQ(a.lights.size(), b.lights.size());
    for (size_t i = 0; i < a.lights.size(); ++i) expect_like(a.lights[i], b.lights[i]);
    EXPECT_NEAR(a.camera.window_left, b.camera.window_left, 1e-6);
    EXPECT_NEAR(a.camera.window_top, b.camera.window_top, 1e-6);
    EXPECT_NEAR(a.camera.clip_near, b.camera.clip_near, 1e-6 * double(unit));
    EXPECT_NEAR(a.camera.clip_far, b.camera.clip_far, 1e-4 * double(unit));
    EXPECT_TRUE(a.camera.render_from_camera.equalWithAbsError(b.camera.render_from_camera, 1e-6));
    EXPECT_NEAR((a.camera.world_position - b.camera.world_position).length(), 0,
                1e-6 * double(unit));
    EXPECT_EQ(a.meters_per_unit, b.meters_per_unit);
}

}  // namespace

TEST_F(Import, GltfIsLikeItsUsdTwin) {
    const auto summary = run(files / "room.gltf");
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->meshes, 2u);
    EXPECT_EQ(summary->instances, 2u);
    EXPECT_EQ(summary->lights, 2u);
    EXPECT_EQ(summary->cameras, 1u);
    EXPECT_EQ(summary->textures, 1u);
    EXPECT_EQ(diagnostics_.warning_count(), 0u);
    const scene::Scene imported = translate(output());
    EXPECT_EQ(imported.prototypes.size(), 1u);
    EXPECT_EQ(imported.instances.size(), 2u);
    expect_like(imported, translate(files / "room_gltf.usda"), 1.0f);
}

TEST_F(Import, EmbeddedImagesAreWrittenBesideTheLayer) {
    ASSERT_TRUE(run(files / "room.gltf"));
    const usd::stage::Stage stage = open(output());
    const auto file = stage.prim_at("/out/Materials/Tiles/Texture").attribute("inputs:file");
    EXPECT_EQ(file.get_or<usd::layer::AssetPath>({}).path.rfind("./out_textures/", 0), 0u);
    const std::string bytes = text_of(file.resolved_asset_path());
    EXPECT_EQ(bytes.substr(1, 3), "PNG");
    EXPECT_EQ(bytes.substr(bytes.size() - 8, 4), "IEND");
}

TEST_F(Import, ColladaIsLikeItsUsdTwin) {
    const auto summary = run(files / "room.dae");
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->meshes, 1u);
    EXPECT_EQ(summary->instances, 2u);
    EXPECT_EQ(diagnostics_.warning_count(), 0u);
    const usd::stage::Stage stage = open(output());
    EXPECT_EQ(stage.up_axis(), "Z");
    EXPECT_EQ(stage.meters_per_unit(), 0.01);
    expect_like(translate(output()), translate(files / "room_dae.usda"), 1000.0f);
}

TEST_F(Import, FbxIsLikeItsUsdTwin) {
    const auto summary = run(files / "room.fbx");
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->meshes, 1u);
    EXPECT_EQ(summary->instances, 2u);
    EXPECT_EQ(summary->lights, 3u);
    EXPECT_EQ(summary->cameras, 1u);
    // Lamp and Spot do not decay, which no light of USD does
    EXPECT_EQ(count("import-falloff"), 2u);
    EXPECT_EQ(diagnostics_.warning_count(), 2u);
    EXPECT_EQ(count("import-projection"), 1u);
    expect_like(translate(output()), translate(files / "room_fbx.usda"), 1000.0f);
}

TEST_F(Import, FbxRoughnessFollowsTheProgramThatWroteIt) {
    // Blender writes the exponent (10 (1 - roughness))^2, others Phong's
    for (const auto& [creator, roughness] :
         {std::pair("Blender (stable FBX IO)", 0.45227744f), std::pair("written by hand", 0.5f)}) {
        std::string text = text_of(files / "room.fbx");
        const std::string by_hand = "written by hand";
        text.replace(text.find(by_hand), by_hand.size(), creator);
        std::ofstream(folder_ / "room.fbx") << text;
        ASSERT_TRUE(run(folder_ / "room.fbx"));
        const usd::stage::Stage stage = open(output());
        const auto shader = stage.prim_at("/out/Materials/red_paint/Surface");
        EXPECT_NEAR(shader.attribute("inputs:roughness").get_or<float>(-1.0f), roughness, 1e-6f);
    }
}

TEST_F(Import, FbxEmissionHasItsIntensity) {
    std::string text = text_of(files / "room.fbx");
    const std::string before = "P: \"DiffuseColor\"";
    text.insert(text.find(before), "P: \"Maya|emissive_intensity\", \"Float\", \"\", \"A\",3\n");
    std::ofstream(folder_ / "room.fbx") << text;
    ASSERT_TRUE(run(folder_ / "room.fbx"));
    const usd::stage::Stage stage = open(output());
    EXPECT_EQ(stage.prim_at("/out/Materials/red_paint/Surface")
                  .attribute("inputs:emissiveColor")
                  .get<usd::layer::Vec3f>(),
              usd::layer::Vec3f(1.5f, 0, 0));
}

TEST_F(Import, FbxCameraWithoutAnAngleIsNamed) {
    std::string text = text_of(files / "room.fbx");
    const size_t line = text.find("P: \"FieldOfView\"");
    text.erase(line, text.find('\n', line) - line);
    std::ofstream(folder_ / "room.fbx") << text;
    ASSERT_TRUE(run(folder_ / "room.fbx"));
    EXPECT_EQ(count("import-camera"), 1u);
    EXPECT_EQ(open(output()).prim_at("/out/Eye/Camera").attribute("focalLength").get<float>(),
              50.0f);
}

TEST_F(Import, FbxUnitAndUpAxisAreKept) {
    std::string text = text_of(files / "room.fbx");
    const auto swap = [&](const std::string& from, const std::string& to) {
        ASSERT_NE(text.find(from), std::string::npos);
        text.replace(text.find(from), from.size(), to);
    };
    swap("\"UpAxis\", \"int\", \"Integer\", \"\",1", "\"UpAxis\", \"int\", \"Integer\", \"\",2");
    swap("\"UnitScaleFactor\", \"double\", \"Number\", \"\",1",
         "\"UnitScaleFactor\", \"double\", \"Number\", \"\",100");
    std::ofstream(folder_ / "room.fbx") << text;
    ASSERT_TRUE(run(folder_ / "room.fbx"));
    const usd::stage::Stage stage = open(output());
    EXPECT_EQ(stage.up_axis(), "Z");
    EXPECT_EQ(stage.meters_per_unit(), 1.0);
}

TEST_F(Import, ObjKeepsPolygonsMaterialsAndNames) {
    const auto summary = run(files / "box.obj");
    ASSERT_TRUE(summary) << summary.error().message;
    EXPECT_EQ(summary->meshes, 3u);
    const usd::stage::Stage stage = open(output());
    EXPECT_EQ(stage.default_prim().path_string(), "/out");
    std::vector<int> corners;
    usd::stage::traverse(stage.pseudo_root(), [&](usd::stage::Prim prim) {
        for (const int n : prim.attribute("faceVertexCounts").get_or<std::vector<int>>({}))
            corners.push_back(n);
        return true;
    });
    std::sort(corners.begin(), corners.end());
    EXPECT_EQ(corners, (std::vector<int>{3, 4, 5}));
    const auto input = [&](const char* material, const char* name) {
        return stage.prim_at(std::string("/out/Materials/") + material + "/Surface")
            .attribute(std::string("inputs:") + name);
    };
    EXPECT_EQ(input("plaster", "diffuseColor").get<usd::layer::Vec3f>(),
              usd::layer::Vec3f(0.75f, 0.5f, 0.25f));
    EXPECT_EQ(input("plaster", "specularColor").get<usd::layer::Vec3f>(), usd::layer::Vec3f(0.0f));
    EXPECT_EQ(input("lamp", "emissiveColor").get<usd::layer::Vec3f>(),
              usd::layer::Vec3f(17, 12, 4));
    // Illumination model 7: what is not reflected goes through
    EXPECT_EQ(input("glass", "opacity").get<float>(), 0.0f);
    EXPECT_EQ(input("glass", "roughness").get<float>(), 0.0f);
    EXPECT_EQ(input("glass", "ior").get<float>(), 1.5f);
    // The line is left out, the texture is not there
    EXPECT_EQ(count("import-points-lines"), 1u);
    EXPECT_EQ(count("import-texture"), 1u);
}

TEST_F(Import, PlyShowsItsVertexColors) {
    const auto summary = run(files / "points.ply");
    ASSERT_TRUE(summary) << summary.error().message;
    const scene::Scene scene = translate(output());
    ASSERT_EQ(scene.shapes.size(), 1u);
    const auto meshes = placed_meshes(scene);
    EXPECT_EQ(meshes[0].counts, (std::vector<uint32_t>{4, 3}));
    ASSERT_GE(meshes[0].colors.size(), 3u);
    EXPECT_EQ(meshes[0].colors[0], 1.0f);
    EXPECT_EQ(meshes[0].colors[1], 0.0f);
    ASSERT_TRUE(meshes[0].material != nullptr);
    EXPECT_EQ(meshes[0].material->diffuse_color.source, scene::Input::Source::Primvar);
}

TEST_F(Import, ReadsBinaryGltf) {
    std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
"min":[0,0,0],"max":[2,3,0]}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":36}],"buffers":[{"byteLength":36}]})";
    while (json.size() % 4 != 0) json += ' ';
    const std::array<float, 9> points = {0, 0, 0, 2, 0, 0, 0, 3, 0};
    const auto word = [](size_t n) {
        std::string bytes;
        for (int i = 0; i < 4; ++i) bytes += char((n >> (8 * i)) & 255);
        return bytes;
    };
    const fs::path file = folder_ / "one.glb";
    std::ofstream stream(file, std::ios::binary);
    stream << "glTF" << word(2) << word(28 + json.size() + 36) << word(json.size()) << "JSON"
           << json << word(36) << std::string("BIN\0", 4);
    stream.write(reinterpret_cast<const char*>(points.data()), 36);
    stream.close();
    const auto summary = run(file);
    ASSERT_TRUE(summary) << summary.error().message;
    const scene::Scene scene = translate(output());
    ASSERT_EQ(scene.shapes.size(), 1u);
    const auto& mesh = std::get<scene::Mesh>(scene.shapes[0].geometry);
    ASSERT_EQ(mesh.points.size(), 3u);
    EXPECT_FLOAT_EQ((mesh.points[1] - mesh.points[0]).length(), 2.0f);
    EXPECT_FLOAT_EQ((mesh.points[2] - mesh.points[0]).length(), 3.0f);
}

TEST_F(Import, BrokenInputLeavesNothingBehind) {
    const std::string gltf = text_of(files / "room.gltf");
    const std::array<std::pair<const char*, std::string>, 7> broken = {{
        {"empty.obj", ""},
        {"truncated.gltf", gltf.substr(0, gltf.size() / 2)},
        {"wrong.dae", "<COLLADA><asset>"},
        {"header.ply", "ply\nformat ascii 1.0\nelement vertex 99999999\n"},
        {"counts.ply",
         "ply\nformat ascii 1.0\nelement vertex 99999999\nproperty float x\nend_header\n1\n"},
        {"noise.fbx", "Kaydara FBX Binary  \x01\x02\x03 not really"},
        {"noise.glb", "glTF\x02 and nothing"},
    }};
    for (const auto& [name, text] : broken) {
        std::ofstream(folder_ / name, std::ios::binary) << text;
        const auto summary = run(folder_ / name);
        ASSERT_FALSE(summary) << name;
        EXPECT_EQ(summary.error().code.rfind("import-", 0), 0u) << name;
        EXPECT_FALSE(fs::exists(output())) << name;
        EXPECT_FALSE(fs::exists(folder_ / "out_textures")) << name;
    }
    EXPECT_EQ(run(folder_ / "absent.obj").error().code, "import-read");
    EXPECT_EQ(run(folder_ / "scene.blend").error().code, "import-format");
}

TEST_F(Import, FolderThatCannotBeWrittenIsAnError) {
    const auto summary = import_file((files / "room.gltf").string(),
                                     (folder_ / "no/such/out.usda").string(), diagnostics_);
    ASSERT_FALSE(summary);
    EXPECT_EQ(summary.error().code, "io-write");
    EXPECT_FALSE(fs::exists(folder_ / "no"));
}

}  // namespace velatura::import
