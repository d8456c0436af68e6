// SPDX-License-Identifier: Apache-2.0
#include "import/context.h"

#include <assimp/mesh.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace velatura::import {

namespace {

namespace layer = usd::layer;

std::vector<layer::Vec3f> vectors(const aiVector3D* from, unsigned count) {
    std::vector<layer::Vec3f> out;
    out.reserve(count);
    for (unsigned i = 0; i < count; ++i)
        out.emplace_back(float(from[i].x), float(from[i].y), float(from[i].z));
    return out;
}

/// Corners of the faces; points and lines are left out.
void author_faces(Context& ctx, Path prim, const aiMesh& mesh) {
    std::vector<int> counts, indices;
    size_t omitted = 0;
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
        const aiFace& face = mesh.mFaces[f];
        if (face.mNumIndices < 3) {
            ++omitted;
            continue;
        }
        counts.push_back(int(face.mNumIndices));
        for (unsigned i = 0; i < face.mNumIndices; ++i) indices.push_back(int(face.mIndices[i]));
    }
    if (omitted > 0)
        ctx.warn("import-points-lines",
                 fmt::format("{} points or lines of a mesh are skipped; only faces are imported",
                             omitted),
                 prim.to_string());
    ctx.author.attribute(prim, "faceVertexCounts", "int[]", Value::array(std::move(counts)));
    ctx.author.attribute(prim, "faceVertexIndices", "int[]", Value::array(std::move(indices)));
}

void author_coordinates(Context& ctx, Path prim, const aiMesh& mesh) {
    for (unsigned set = 0; set < mesh.GetNumUVChannels(); ++set) {
        std::vector<layer::Vec2f> st;
        st.reserve(mesh.mNumVertices);
        for (unsigned i = 0; i < mesh.mNumVertices; ++i)
            st.emplace_back(float(mesh.mTextureCoords[set][i].x),
                            float(mesh.mTextureCoords[set][i].y));
        const std::string name = set == 0 ? "primvars:st" : fmt::format("primvars:st{}", set);
        ctx.author.interpolated(prim, name, "texCoord2f[]", "vertex", Value::array(std::move(st)));
    }
}

/// Vertex colors; those that a material shows are multiplied by its constant color here, since
/// its shader takes them alone.
void author_colors(Context& ctx, Path prim, const aiMesh& mesh) {
    if (!mesh.HasVertexColors(0)) return;
    BaseColor base;
    if (has_shown_colors(ctx, mesh))
        base = base_color(ctx, *ctx.scene.mMaterials[mesh.mMaterialIndex]);
    std::vector<layer::Vec3f> colors;
    std::vector<float> opacities;
    bool is_opaque = true;
    for (unsigned i = 0; i < mesh.mNumVertices; ++i) {
        const aiColor4D& c = mesh.mColors[0][i];
        colors.emplace_back(float(c.r) * base.color.x, float(c.g) * base.color.y,
                            float(c.b) * base.color.z);
        opacities.push_back(float(c.a) * base.opacity);
        is_opaque = is_opaque && c.a >= 1;
    }
    ctx.author.interpolated(prim, "primvars:displayColor", "color3f[]", "vertex",
                            Value::array(std::move(colors)));
    if (!is_opaque)
        ctx.author.interpolated(prim, "primvars:displayOpacity", "float[]", "vertex",
                                Value::array(std::move(opacities)));
    if (mesh.GetNumColorChannels() > 1)
        ctx.warn("import-colors", "only the first set of vertex colors is imported",
                 prim.to_string());
}

void author_extent(Context& ctx, Path prim, const std::vector<layer::Vec3f>& points) {
    Box3 box;
    for (const layer::Vec3f& p : points) box.extendBy(p);
    if (box.isEmpty()) return;
    ctx.author.attribute(prim, "extent", "float3[]",
                         Value::array(std::vector<layer::Vec3f>{box.min, box.max}));
}

bool is_two_sided(const Context& ctx, const aiMesh& mesh) {
    int two_sided = 0;
    return mesh.mMaterialIndex < ctx.scene.mNumMaterials &&
           ctx.scene.mMaterials[mesh.mMaterialIndex]->Get(AI_MATKEY_TWOSIDED, two_sided) ==
               aiReturn_SUCCESS &&
           two_sided != 0;
}

}  // namespace

Path author_mesh(Context& ctx, Path parent, const aiMesh& mesh, const std::string& name) {
    const Path prim = ctx.author.define(parent, name.empty() ? "Mesh" : name, "Mesh");
    ++ctx.summary.meshes;
    std::vector<layer::Vec3f> points = vectors(mesh.mVertices, mesh.mNumVertices);
    author_extent(ctx, prim, points);
    ctx.author.attribute(prim, "points", "point3f[]", Value::array(std::move(points)));
    author_faces(ctx, prim, mesh);
    if (mesh.HasNormals())
        ctx.author.interpolated(prim, "normals", "normal3f[]", "vertex",
                                Value::array(vectors(mesh.mNormals, mesh.mNumVertices)));
    author_coordinates(ctx, prim, mesh);
    author_colors(ctx, prim, mesh);
    ctx.author.uniform_token(prim, "subdivisionScheme", "none");
    if (is_two_sided(ctx, mesh)) ctx.author.uniform(prim, "doubleSided", "bool", Value(true));
    if (mesh.HasBones())
        ctx.warn("import-skin", "bones are not imported, the mesh keeps its bind pose",
                 prim.to_string());
    if (mesh.mNumAnimMeshes > 0)
        ctx.warn("import-morph",
                 fmt::format("{} morph targets are not imported", mesh.mNumAnimMeshes),
                 prim.to_string());
    return prim;
}

}  // namespace velatura::import
