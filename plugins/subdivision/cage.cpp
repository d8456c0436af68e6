// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/cage.h"

#include <fmt/format.h>
#include <opensubdiv/bfr/limits.h>
#include <opensubdiv/far/error.h>
#include <opensubdiv/far/topologyDescriptor.h>
#include <opensubdiv/far/topologyLevel.h>
#include <opensubdiv/far/topologyRefinerFactory.h>
#include <opensubdiv/version.h>

#include <algorithm>
#include <limits>
#include <numeric>
#include <string>

namespace velatura::plugins::subdivision {

namespace {

/// What OpenSubdiv, which prints otherwise, last said to this thread.
thread_local std::string complaint;

void hear_error(Far::ErrorType, const char* message) {
    complaint = message;
}

void hear_warning(const char* message) {
    complaint = message;
}

void listen_to_opensubdiv() {
    static std::once_flag is_set;
    std::call_once(is_set, [] {
        Far::SetErrorCallback(hear_error);
        Far::SetWarningCallback(hear_warning);
    });
}

/// On one line, without a full stop.
std::string tidy(std::string text) {
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (!text.empty() && (text.back() == ' ' || text.back() == '.')) text.pop_back();
    return text;
}

Sdc::SchemeType scheme_of(const scene::Mesh& mesh) {
    switch (mesh.subdivision) {
        case scene::SubdivisionScheme::Loop:
            return Sdc::SCHEME_LOOP;
        case scene::SubdivisionScheme::Bilinear:
            return Sdc::SCHEME_BILINEAR;
        default:
            return Sdc::SCHEME_CATMARK;
    }
}

Sdc::Options options_of(const scene::SubdivisionRules& rules) {
    using Boundary = scene::BoundaryInterpolation;
    using FaceVarying = scene::FaceVaryingInterpolation;
    Sdc::Options options;
    switch (rules.boundary) {
        case Boundary::None:
            options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_NONE);
            break;
        case Boundary::EdgeOnly:
            options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_ONLY);
            break;
        case Boundary::EdgeAndCorner:
            options.SetVtxBoundaryInterpolation(Sdc::Options::VTX_BOUNDARY_EDGE_AND_CORNER);
            break;
    }
    switch (rules.face_varying) {
        case FaceVarying::None:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_NONE);
            break;
        case FaceVarying::CornersOnly:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_CORNERS_ONLY);
            break;
        case FaceVarying::CornersPlus1:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_CORNERS_PLUS1);
            break;
        case FaceVarying::CornersPlus2:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_CORNERS_PLUS2);
            break;
        case FaceVarying::Boundaries:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_BOUNDARIES);
            break;
        case FaceVarying::All:
            options.SetFVarLinearInterpolation(Sdc::Options::FVAR_LINEAR_ALL);
            break;
    }
    options.SetTriangleSubdivision(rules.triangles == scene::TriangleRule::Smooth
                                       ? Sdc::Options::TRI_SUB_SMOOTH
                                       : Sdc::Options::TRI_SUB_CATMARK);
    return options;
}

/// Levels down to which patches are those of uniform refinement; within the last one around an
/// extraordinary vertex they are Gregory patches, off by less than 1/2000 of an edge. Deeper ones
/// than 5 gain nothing: OpenSubdiv 3.5.0 then goes wrong by more than that between some creases.
SurfaceFactory::Options surface_options(bool can_share_patches) {
    return SurfaceFactory::Options().SetApproxLevelSmooth(5).SetApproxLevelSharp(6).EnableCaching(
        can_share_patches);
}

template <class T>
std::vector<int> to_ints(const std::vector<T>& values) {
    return std::vector<int>(values.begin(), values.end());
}

/// Values of a face-varying primvar as a topology of its own: without indices every corner has one.
struct FaceVaryingTopology {
    std::vector<int> values;  ///< [corner]
    int count = 0;
};

FaceVaryingTopology topology_of(const scene::Primvar& primvar, size_t corners) {
    FaceVaryingTopology out;
    out.count = int(primvar.values.size() / primvar.width);
    if (!primvar.indices.empty()) {
        out.values = to_ints(primvar.indices);
    } else {
        out.values.resize(corners);
        std::iota(out.values.begin(), out.values.end(), 0);
    }
    return out;
}

std::unique_ptr<const Far::TopologyRefiner> make_refiner(const scene::Mesh& mesh,
                                                         const std::vector<size_t>& face_varying) {
    const std::vector<int> counts = to_ints(mesh.face_vertex_counts);
    const std::vector<int> indices = to_ints(mesh.face_vertex_indices);
    const std::vector<int> corners = to_ints(mesh.rules.corners);
    const std::vector<int> holes = to_ints(mesh.rules.holes);
    std::vector<int> creases;
    for (const auto& [a, b] : mesh.rules.creases) creases.insert(creases.end(), {int(a), int(b)});
    std::vector<FaceVaryingTopology> topologies;
    std::vector<Far::TopologyDescriptor::FVarChannel> channels;
    for (const size_t p : face_varying)
        topologies.push_back(topology_of(mesh.primvars[p], indices.size()));
    for (const FaceVaryingTopology& topology : topologies) {
        channels.emplace_back();
        channels.back().numValues = topology.count;
        channels.back().valueIndices = topology.values.data();
    }

    Far::TopologyDescriptor description;
    description.numVertices = int(mesh.points.size());
    description.numFaces = int(counts.size());
    description.numVertsPerFace = counts.data();
    description.vertIndicesPerFace = indices.data();
    description.numCreases = int(mesh.rules.creases.size());
    description.creaseVertexIndexPairs = creases.data();
    description.creaseWeights = mesh.rules.crease_sharpnesses.data();
    description.numCorners = int(corners.size());
    description.cornerVertexIndices = corners.data();
    description.cornerWeights = mesh.rules.corner_sharpnesses.data();
    description.numHoles = int(holes.size());
    description.holeIndices = holes.data();
    description.numFVarChannels = int(channels.size());
    description.fvarChannels = channels.data();
    using Factory = Far::TopologyRefinerFactory<Far::TopologyDescriptor>;
    Factory::Options options(scheme_of(mesh), options_of(mesh.rules));
    options.validateFullTopology = true;
    return std::unique_ptr<const Far::TopologyRefiner>(Factory::Create(description, options));
}

/// Whether some face has one vertex twice.
bool has_folded_face(const scene::Mesh& mesh) {
    std::vector<uint32_t> vertices;
    auto first = mesh.face_vertex_indices.begin();
    for (const uint32_t count : mesh.face_vertex_counts) {
        vertices.assign(first, first + count);
        std::sort(vertices.begin(), vertices.end());
        if (std::adjacent_find(vertices.begin(), vertices.end()) != vertices.end()) return true;
        first += count;
    }
    return false;
}

/// Why these polygons cannot be given to OpenSubdiv; empty: they can.
std::string fault_of(const scene::Mesh& mesh) {
    constexpr size_t max = size_t(std::numeric_limits<int>::max());
    if (mesh.face_vertex_indices.size() > max || mesh.points.size() > max)
        return "more corners or points than OpenSubdiv supports";
    const auto is_triangle = [](uint32_t count) { return count == 3; };
    if (mesh.subdivision == scene::SubdivisionScheme::Loop &&
        !std::all_of(mesh.face_vertex_counts.begin(), mesh.face_vertex_counts.end(), is_triangle))
        return "the scheme loop needs triangles";
    const uint32_t largest =
        *std::max_element(mesh.face_vertex_counts.begin(), mesh.face_vertex_counts.end());
    if (largest > uint32_t(Bfr::Limits::MaxFaceSize()))
        return fmt::format("a face with {} corners", largest);
    if (has_folded_face(mesh)) return "a face uses a vertex twice";
    return {};
}

/// Whether some other face has both edges of the face at one of its corners.
bool shares_two_edges(const Far::TopologyLevel& level, int face) {
    const auto edges = level.GetFaceEdges(face);
    for (int c = 0; c < edges.size(); ++c) {
        const auto before = level.GetEdgeFaces(edges[c]),
                   after = level.GetEdgeFaces(edges[(c + 1) % edges.size()]);
        for (const int other : before)
            if (other != face && std::find(after.begin(), after.end(), other) != after.end())
                return true;
    }
    return false;
}

bool has_crease_at_corners(const Far::TopologyLevel& level, int face) {
    for (const int vertex : level.GetFaceVertices(face))
        for (const int edge : level.GetVertexEdges(vertex))
            if (level.GetEdgeSharpness(edge) > 0.0f &&
                (!level.IsEdgeBoundary(edge) || level.IsEdgeNonManifold(edge)))
                return true;
    return false;
}

/// Whether OpenSubdiv up to 3.5.0 would take indices of creases from memory that it never wrote,
/// which may end the process. Ref: OpenSubdiv 3.5.1, release notes, "Bfr::Surface construction bug
/// for rare topological case".
bool is_misread(const Far::TopologyLevel& level) {
    if (OPENSUBDIV_VERSION_NUMBER >= 30501) return false;
    for (int face = 0; face < level.GetNumFaces(); ++face)
        if (shares_two_edges(level, face) && has_crease_at_corners(level, face)) return true;
    return false;
}

/// Whether faces of the same neighborhood may share their patches: where a face meets another
/// along two edges in a row, OpenSubdiv gives such patches to faces that they do not fit, and reads
/// beyond its memory. Ref: its pull request 1353.
bool can_share_patches(const Far::TopologyLevel& level) {
    for (int face = 0; face < level.GetNumFaces(); ++face)
        if (shares_two_edges(level, face)) return false;
    return true;
}

}  // namespace

Result<Cage> make_cage(const scene::Mesh& mesh) {
    listen_to_opensubdiv();
    if (const std::string fault = fault_of(mesh); !fault.empty())
        return Error{"subdivision", "no limit surface: " + fault};
    Cage cage;
    for (size_t p = 0; p < mesh.primvars.size(); ++p)
        if (mesh.primvars[p].interpolation == scene::Interpolation::FaceVarying)
            cage.face_varying.push_back(p);
    complaint.clear();
    cage.refiner = make_refiner(mesh, cage.face_varying);
    if (!cage.refiner) return Error{"subdivision", "no limit surface: " + tidy(complaint)};
    if (is_misread(cage.refiner->GetLevel(0)))
        return Error{"subdivision",
                     "no limit surface: a crease at a face that shares two consecutive edges with "
                     "another, which needs OpenSubdiv 3.5.1"};
    cage.factory = std::make_unique<const SurfaceFactory>(
        *cage.refiner, surface_options(can_share_patches(cage.refiner->GetLevel(0))));
    return cage;
}

}  // namespace velatura::plugins::subdivision
