// SPDX-License-Identifier: Apache-2.0
#include "import/import.h"

#include "base/asset_bytes.h"
#include "base/atomic_file.h"
#include "base/isolated.h"
#include "import/context.h"
#include "import/gltf.h"
#include "usd/layer/fields.h"
#include "usd/text/writer.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/DefaultLogger.hpp>
#include <assimp/Importer.hpp>
#include <assimp/LogStream.hpp>
#include <assimp/MemoryIOWrapper.h>
#include <assimp/config.h>
#include <assimp/postprocess.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <memory>
#include <mutex>
#include <optional>
#include <sstream>

namespace velatura::import {

namespace {

namespace fs = std::filesystem;
namespace layer = usd::layer;

constexpr int max_depth = 500;

std::optional<Format> format_of(const fs::path& file) {
    std::string suffix = file.extension().string();
    std::transform(suffix.begin(), suffix.end(), suffix.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    if (suffix == ".dae") return Format::Collada;
    if (suffix == ".fbx") return Format::Fbx;
    if (suffix == ".gltf" || suffix == ".glb") return Format::Gltf;
    if (suffix == ".obj") return Format::Obj;
    if (suffix == ".ply") return Format::Ply;
    return std::nullopt;
}

/// Assimp trusts the counts of a .ply header: checks that it ends and asks for no more elements
/// than the file has bytes.
Result<void> check_ply_header(const fs::path& file) {
    const Result<std::string> bytes = read_file(file.string());
    if (!bytes) return Error{"import-read", bytes.error().message};
    const auto broken = [&](const std::string& why) {
        return Error{"import-read", fmt::format("{} cannot be read: {}", file.string(), why)};
    };
    const size_t end = bytes->find("end_header");
    if (end == std::string::npos) return broken("its header has no end_header");
    std::istringstream header(bytes->substr(0, end));
    for (std::string word; header >> word;) {
        uint64_t count = 0;
        if (word != "element" || !(header >> word >> count)) continue;
        if (count > bytes->size() - end)
            return broken(
                fmt::format("{} elements \"{}\" in {} bytes", count, word, bytes->size() - end));
    }
    return {};
}

/// What Assimp has to say, as warnings.
class LogToDiagnostics final : public Assimp::LogStream {
  public:
    LogToDiagnostics(Diagnostics& diagnostics, SourceLoc loc)
        : diagnostics_(diagnostics), loc_(loc) {}

    void write(const char* message) override {
        std::string text = message;
        // "Warn,  T0: …"
        const size_t colon = text.find(": ");
        if (colon != std::string::npos && colon < 16) text.erase(0, colon + 2);
        while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back())))
            text.pop_back();
        diagnostics_.warn("import-assimp", loc_, "", text);
    }

  private:
    Diagnostics& diagnostics_;
    SourceLoc loc_;
};

/// The bytes of an asset, for Assimp.
class AssetStream final : public Assimp::MemoryIOStream {
  public:
    explicit AssetStream(const AssetBytesPtr& asset)
        : MemoryIOStream(reinterpret_cast<const uint8_t*>(asset->bytes().data()),
                         asset->bytes().size()),
          asset_(asset) {}

  private:
    AssetBytesPtr asset_;
};

/// Files as they are on disk, where they may be read, but for the model itself, whose bytes may be
/// others.
class ModelFiles final : public Assimp::DefaultIOSystem {
  public:
    ModelFiles(std::string model, Diagnostics& diagnostics, SourceLoc loc)
        : model_(std::move(model)), diagnostics_(diagnostics), loc_(loc) {}

    void replace_model(std::string bytes) { replaced_ = make_asset_bytes(std::move(bytes)); }

    bool Exists(const char* name) const override { return asset_exists(name); }

    Assimp::IOStream* Open(const char* name, const char*) override {
        if (replaced_ && name == model_) return new AssetStream(replaced_);
        const Result<AssetBytesPtr> asset = open_asset_bytes(name);
        if (asset) return new AssetStream(*asset);
        // What is not there the importer says itself
        if (asset.error().code != "file-not-found")
            diagnostics_.error(asset.error().code, loc_, "", asset.error().message);
        return nullptr;
    }

  private:
    std::string model_;
    AssetBytesPtr replaced_;
    Diagnostics& diagnostics_;
    SourceLoc loc_;
};

/// What Assimp reads, made ready for it.
void prepare(Assimp::Importer& importer,
             const fs::path& file,
             Format format,
             Diagnostics& diagnostics,
             SourceLoc loc) {
    auto files = std::make_unique<ModelFiles>(file.string(), diagnostics, loc);
    if (format == Format::Gltf) {
        const Result<std::string> bytes = read_file(file.string());
        std::optional<std::string> better;
        if (bytes) better = prepare_gltf(*bytes, file.parent_path(), diagnostics, loc);
        if (better) files->replace_model(*std::move(better));
    }
    // The importer owns it
    importer.SetIOHandler(files.release());
}

/// Reads the file; Assimp's logger is one per process.
Result<const aiScene*> read_scene(Assimp::Importer& importer,
                                  const fs::path& file,
                                  Diagnostics& diagnostics,
                                  SourceLoc loc) {
    static std::mutex logger_in_use;
    const std::lock_guard lock(logger_in_use);
    Assimp::DefaultLogger::create("", Assimp::Logger::NORMAL, 0);
    LogToDiagnostics log(diagnostics, loc);
    const unsigned severities = Assimp::Logger::Err | Assimp::Logger::Warn;
    Assimp::DefaultLogger::get()->attachStream(&log, severities);
    importer.SetPropertyBool(AI_CONFIG_IMPORT_FBX_PRESERVE_PIVOTS, false);
    importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_USE_COLLADA_NAMES, true);
    const aiScene* scene = importer.ReadFile(
        file.string(), aiProcess_JoinIdenticalVertices | aiProcess_ValidateDataStructure);
    Assimp::DefaultLogger::get()->detachStream(&log, severities);
    Assimp::DefaultLogger::kill();
    if (scene == nullptr || scene->mRootNode == nullptr) {
        const std::string reason = importer.GetErrorString();
        return Error{"import-read", fmt::format("{} cannot be read: {}", file.string(),
                                                reason.empty() ? "it contains no scene" : reason)};
    }
    return scene;
}

/// Counts placements and finds the box of everything.
void survey(Context& ctx, const aiNode& node, const Mat4d& world, int depth, Box3d& box) {
    if (depth > max_depth) return;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
        const aiMesh& mesh = *ctx.scene.mMeshes[node.mMeshes[i]];
        ++ctx.uses[node.mMeshes[i]];
        for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
            const aiVector3D& p = mesh.mVertices[v];
            box.extendBy(transform_point(Vec3d(double(p.x), double(p.y), double(p.z)), world));
        }
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i)
        survey(ctx, *node.mChildren[i], to_matrix(node.mChildren[i]->mTransformation) * world,
               depth + 1, box);
}

/// A mesh that is placed many times, as a class to refer to.
void author_prototype(Context& ctx, Path& scope, unsigned index) {
    if (scope.is_empty())
        scope = ctx.author.define(ctx.root, "Prototypes", "Scope", layer::Specifier::Class);
    const aiMesh& mesh = *ctx.scene.mMeshes[index];
    const Path prototype =
        ctx.author.define(scope, mesh.mName.length > 0 ? mesh.mName.C_Str() : "Mesh", "Xform",
                          layer::Specifier::Class);
    author_mesh(ctx, prototype, mesh, "Mesh");
    ctx.prototypes[index] = prototype;
}

void place_mesh(Context& ctx, Path parent, unsigned index) {
    const aiMesh& mesh = *ctx.scene.mMeshes[index];
    const std::string name = mesh.mName.length > 0 ? mesh.mName.C_Str() : "Mesh";
    if (ctx.prototypes[index].is_empty()) {
        bind_material(ctx, author_mesh(ctx, parent, mesh, name), mesh);
        return;
    }
    const Path prim = ctx.author.define(parent, name, "Xform");
    ++ctx.summary.instances;
    ctx.author.metadata(prim, "instanceable", Value(true));
    layer::Reference reference;
    reference.prim_path = ctx.prototypes[index];
    layer::ReferenceListOp references;
    references.prepended.push_back(std::move(reference));
    ctx.author.metadata(prim, "references", Value(std::move(references)));
    bind_material(ctx, prim, mesh);
}

template <class T>
bool is_of_node(const T& item, const aiNode& node) {
    return item.mName.length > 0 && item.mName == node.mName;
}

void author_node(Context& ctx,
                 Path prim,
                 const aiNode& node,
                 const Mat4d& local,
                 const Mat4d& parent,
                 int depth) {
    const Mat4d world = local * parent;
    if (local != Mat4d()) {
        ctx.author.attribute(prim, "xformOp:transform", "matrix4d", Value(layer::Mat4d(local)));
        ctx.author.uniform(
            prim, "xformOpOrder", "token[]",
            Value::array(std::vector<layer::Token>{layer::Token("xformOp:transform")}));
    }
    for (unsigned i = 0; i < node.mNumMeshes; ++i) place_mesh(ctx, prim, node.mMeshes[i]);
    for (unsigned i = 0; i < ctx.scene.mNumCameras; ++i)
        if (is_of_node(*ctx.scene.mCameras[i], node))
            author_camera(ctx, prim, *ctx.scene.mCameras[i]);
    for (unsigned i = 0; i < ctx.scene.mNumLights; ++i)
        if (is_of_node(*ctx.scene.mLights[i], node))
            author_light(ctx, prim, *ctx.scene.mLights[i], world);
    if (depth >= max_depth) {
        if (node.mNumChildren > 0)
            ctx.warn("import-depth",
                     fmt::format("nodes nested deeper than {} are skipped", max_depth),
                     prim.to_string());
        return;
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) {
        const aiNode& child = *node.mChildren[i];
        author_node(ctx, ctx.author.define(prim, child.mName.C_Str(), "Xform"), child,
                    to_matrix(child.mTransformation), world, depth + 1);
    }
}

/// Up axis, unit and what the root node's matrix says beside them.
struct Orientation {
    const char* up_axis = "Y";
    double meters_per_unit = 1.0;
    Mat4d root;
};

/// Assimp turns .dae scenes to +Y and scales them to meters by the matrix of the root node: this
/// undoes both and keeps the file's own axis and unit.
Orientation collada_orientation(const aiScene& scene) {
    Orientation out;
    out.root = to_matrix(scene.mRootNode->mTransformation);
    const Vec3d x(out.root[0][0], out.root[0][1], out.root[0][2]);
    // The file's decimal number, not that of its float
    double unit = x.length();
    const std::string decimal = fmt::format("{:.6g}", unit);
    std::from_chars(decimal.data(), decimal.data() + decimal.size(), unit);
    if (!(unit > 0.0) || !std::isfinite(unit)) return out;
    out.meters_per_unit = unit;
    const Mat4d y_from_z(1, 0, 0, 0, 0, 0, -1, 0, 0, 1, 0, 0, 0, 0, 0, 1);
    for (int r = 0; r < 3; ++r)
        for (int c = 0; c < 3; ++c) out.root[r][c] /= unit;
    if (out.root.equalWithAbsError(y_from_z, 1e-5)) out.up_axis = "Z";
    if (out.root.equalWithAbsError(Mat4d(), 1e-5) || out.up_axis == std::string_view("Z"))
        out.root = Mat4d();
    return out;
}

Orientation orientation(Context& ctx) {
    const aiScene& scene = ctx.scene;
    if (ctx.format == Format::Collada) return collada_orientation(scene);
    Orientation out;
    out.root = to_matrix(scene.mRootNode->mTransformation);
    if (ctx.format != Format::Fbx) return out;
    int axis = 1, sign = 1;
    float centimeters = 1.0f;
    if (scene.mMetaData != nullptr) {
        scene.mMetaData->Get("UpAxis", axis);
        scene.mMetaData->Get("UpAxisSign", sign);
        scene.mMetaData->Get("UnitScaleFactor", centimeters);
    }
    if (axis == 0 || sign < 0)
        ctx.warn("import-up-axis", "the up axis is neither +Y nor +Z; +Y is written");
    else if (axis == 2)
        out.up_axis = "Z";
    out.meters_per_unit = 0.01 * double(centimeters > 0 ? centimeters : 1.0f);
    return out;
}

void author_stage(Context& ctx) {
    const aiScene& scene = ctx.scene;
    ctx.uses.assign(scene.mNumMeshes, 0);
    ctx.prototypes.assign(scene.mNumMeshes, Path());
    ctx.embedded.assign(scene.mNumTextures, std::string());
    Box3d box;
    const Orientation stage = orientation(ctx);
    survey(ctx, *scene.mRootNode, stage.root, 0, box);
    if (!box.isEmpty()) ctx.center = box.center();
    ctx.root = ctx.author.define(Path::absolute_root(), ctx.output.stem().string(), "Xform");
    ctx.author.stage_metadata("defaultPrim", Value(ctx.root.name()));
    ctx.author.stage_metadata("upAxis", Value(layer::Token(stage.up_axis)));
    ctx.author.stage_metadata("metersPerUnit", Value(stage.meters_per_unit));
    if (ctx.format == Format::Obj || ctx.format == Format::Ply)
        ctx.diagnostics.note("import-units", ctx.loc, "",
                             "the format has no units and no up axis; meters and +Y are written");
    Path prototypes;
    for (unsigned i = 0; i < scene.mNumMeshes; ++i)
        if (ctx.uses[i] > 1) author_prototype(ctx, prototypes, i);
    author_node(ctx, ctx.root, *scene.mRootNode, stage.root, Mat4d(), 0);
    if (scene.mNumAnimations > 0)
        ctx.warn("import-animation",
                 fmt::format("{} animations are not imported", scene.mNumAnimations));
}

/// Limits for what Assimp makes of a file: it trusts its input.
IsolationLimits limits_for(const fs::path& file) {
    std::error_code error;
    const uintmax_t size = fs::file_size(file, error);
    const size_t megabytes = error ? 0 : size_t(size >> 20);
    return {.cpu_seconds = 20 + megabytes,
            .wall_seconds = 10 * (20 + megabytes),
            .address_bytes = (8192 + 100 * megabytes) << 20};
}

using nlohmann::json;

json to_binary(const std::string& bytes) {
    return json::binary(std::vector<uint8_t>(bytes.begin(), bytes.end()));
}

std::string from_binary(const json& value) {
    const auto& bytes = value.get_binary();
    return std::string(bytes.begin(), bytes.end());
}

/// Everything but writing; in the child process. The outcome in CBOR.
std::string read_and_convert(const std::string& file, const std::string& output, Format format) {
    Diagnostics diagnostics;
    const SourceLoc loc{diagnostics.file_id(file), 0, 0};
    json out;
    Assimp::Importer importer;
    prepare(importer, file, format, diagnostics, loc);
    const Result<const aiScene*> scene = read_scene(importer, file, diagnostics, loc);
    if (scene) {
        layer::Layer made(output);
        LayerAuthor author(made);
        Context ctx{.scene = **scene,
                    .format = format,
                    .file = fs::absolute(file).lexically_normal(),
                    .output = fs::absolute(output).lexically_normal(),
                    .author = author,
                    .diagnostics = diagnostics,
                    .loc = loc};
        author_stage(ctx);
        const ImportSummary& s = ctx.summary;
        out["summary"] = {s.meshes, s.instances, s.materials, s.lights, s.cameras, s.textures};
        out["text"] = to_binary(usd::text::write_text_layer(made));
        out["images"] = json::array();
        for (const auto& [path, bytes] : ctx.images)
            out["images"].push_back({to_binary(path.string()), to_binary(bytes)});
    } else {
        out["error"] = {to_binary(scene.error().code), to_binary(scene.error().message)};
    }
    out["diagnostics"] = json::array();
    for (const Diagnostic& d : diagnostics.all())
        out["diagnostics"].push_back(
            {int(d.severity), to_binary(d.code), to_binary(d.prim_path), to_binary(d.message)});
    const std::vector<uint8_t> bytes = json::to_cbor(out);
    return std::string(bytes.begin(), bytes.end());
}

/// Writes the images, then the layer; when one fails, none stays.
Result<void> write_outcome(const json& outcome, const std::string& output) {
    std::vector<fs::path> written;
    fs::path made_folder;
    std::error_code ignored;
    Result<void> result;
    for (const json& image : outcome["images"]) {
        const fs::path path = from_binary(image[0]);
        if (fs::create_directory(path.parent_path(), ignored)) made_folder = path.parent_path();
        result = write_file_atomically(path.string(), from_binary(image[1]));
        if (!result) break;
        written.push_back(path);
    }
    if (result) result = write_file_atomically(output, from_binary(outcome["text"]));
    if (result) return result;
    for (const fs::path& path : written) fs::remove(path, ignored);
    // Only when nothing else is in it
    if (!made_folder.empty()) fs::remove(made_folder, ignored);
    return result;
}

}  // namespace

Result<ImportSummary> import_file(const std::string& file,
                                  const std::string& output,
                                  Diagnostics& diagnostics) {
    const std::optional<Format> format = format_of(file);
    if (!format)
        return Error{"import-format",
                     fmt::format("{} is not a .dae, .obj, .gltf, .glb, .ply or .fbx file", file)};
    std::error_code error;
    if (!fs::is_regular_file(file, error))
        return Error{"import-read", fmt::format("{} not found, or not a file", file)};
    const fs::path folder = fs::absolute(output).parent_path();
    if (!fs::is_directory(folder, error))
        return Error{"io-write", fmt::format("folder {} not found", folder.string())};
    if (format == Format::Ply) {
        const Result<void> header = check_ply_header(file);
        if (!header) return header.error();
    }
    const Result<std::string> bytes =
        run_isolated(limits_for(file), [&] { return read_and_convert(file, output, *format); });
    if (!bytes)
        return Error{bytes.error().code == "isolated-timeout" ? "import-timeout" : "import-crashed",
                     fmt::format("{}: {}", file, bytes.error().message)};
    const json outcome = json::from_cbor(*bytes, true, false);
    if (outcome.is_discarded())
        return Error{"import-crashed", fmt::format("{}: reading ended early", file)};
    const SourceLoc loc{diagnostics.file_id(file), 0, 0};
    for (const json& d : outcome["diagnostics"])
        diagnostics.add({Severity(d[0].get<int>()),
                         from_binary(d[1]),
                         loc,
                         from_binary(d[2]),
                         from_binary(d[3]),
                         {}});
    if (outcome.contains("error"))
        return Error{from_binary(outcome["error"][0]), from_binary(outcome["error"][1])};
    const auto numbers = outcome["summary"].get<std::array<size_t, 6>>();
    const ImportSummary summary{numbers[0], numbers[1], numbers[2],
                                numbers[3], numbers[4], numbers[5]};
    if (summary.meshes == 0 && summary.lights == 0 && summary.cameras == 0)
        return Error{"import-empty", fmt::format("{} contains nothing to render", file)};
    const Result<void> written = write_outcome(outcome, output);
    if (!written) return written.error();
    return summary;
}

}  // namespace velatura::import
