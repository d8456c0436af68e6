// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/diagnostics.h"
#include "base/math.h"
#include "import/import.h"
#include "import/layer_author.h"

#include <assimp/matrix4x4.h>
#include <assimp/scene.h>

#include <filesystem>
#include <string>
#include <unordered_map>
#include <utility>
#include <vector>

namespace velatura::import {

enum class Format : unsigned char { Collada, Fbx, Gltf, Obj, Ply };

/// State of one import.
struct Context {
    const aiScene& scene;
    Format format;
    std::filesystem::path file, output;  ///< both absolute
    LayerAuthor& author;
    Diagnostics& diagnostics;
    SourceLoc loc;  ///< of the file, without a line
    ImportSummary summary = {};
    Path root = {};                                        ///< prim of the root node
    Path materials_scope = {};                             ///< made on first use
    std::unordered_map<std::string, Path> materials = {};  ///< by index and kind
    std::vector<Path> prototypes = {};                     ///< [mesh]; empty = placed once
    std::vector<size_t> uses = {};                         ///< [mesh] placements
    /// [embedded texture] path to write into the layer; empty = not written yet
    std::vector<std::string> embedded = {};
    /// Embedded images to write: file and bytes.
    std::vector<std::pair<std::filesystem::path, std::string>> images = {};
    Vec3d center = Vec3d(0.0);  ///< of everything, in the world

    void warn(std::string code, std::string message, std::string prim = {}) {
        diagnostics.warn(std::move(code), loc, std::move(prim), std::move(message));
    }

    std::filesystem::path texture_folder() const {
        return output.parent_path() / (output.stem().string() + "_textures");
    }
};

/// The same transform for row vectors, in double.
Mat4d to_matrix(const aiMatrix4x4& m);

/// Whether the mesh carries vertex colors that its material can show.
bool has_shown_colors(Context& ctx, const aiMesh& mesh);

/// Prim of a material; with `has_colors` its diffuse color comes from displayColor.
Path material_prim(Context& ctx, unsigned index, bool has_colors);
/// Binds the mesh's material to `prim`.
void bind_material(Context& ctx, Path prim, const aiMesh& mesh);

/// Constant part of a material's diffuse color and opacity.
struct BaseColor {
    Vec3 color = Vec3(1.0f);
    float opacity = 1.0f;
};

BaseColor base_color(const Context& ctx, const aiMaterial& material);

/// Writes a Mesh prim below `parent`.
Path author_mesh(Context& ctx, Path parent, const aiMesh& mesh, const std::string& name);

void author_camera(Context& ctx, Path parent, const aiCamera& camera);
/// `world`: of the node that holds the light.
void author_light(Context& ctx, Path parent, const aiLight& light, const Mat4d& world);

/// A path as files of other formats write it: slashes turned, "%20" and the like read, "file://"
/// taken off.
std::string file_of_uri(std::string name);

/// Path of a material's texture, as it is to stand in the layer; empty when there is none. Writes
/// embedded images.
std::string texture_asset(Context& ctx, const std::string& name, const std::string& material);

}  // namespace velatura::import
