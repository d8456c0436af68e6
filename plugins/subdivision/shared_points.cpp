// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/shared_points.h"

#include "scene/ids.h"

#include <opensubdiv/far/topologyLevel.h>

#include <algorithm>
#include <numeric>
#include <utility>

namespace velatura::plugins::subdivision {

namespace {

/// Whether normals or face-varying numbers may differ between the faces at an edge.
bool is_discontinuous(const Far::TopologyLevel& level, int edge, bool is_bilinear) {
    if (is_bilinear || level.IsEdgeInfSharp(edge)) return true;
    for (int channel = 0; channel < level.GetNumFVarChannels(); ++channel)
        if (!level.DoesEdgeFVarTopologyMatch(edge, channel)) return true;
    return false;
}

/// Puts the corners at one vertex into wedges.
class WedgeFinder {
  public:
    WedgeFinder(const Far::TopologyLevel& level, SharedPoints& shared)
        : level_(level), shared_(shared) {}

    void find(int vertex, bool all_apart) {
        list_corners(vertex);
        parents_.resize(corners_.size());
        std::iota(parents_.begin(), parents_.end(), 0u);
        if (!all_apart) join_along_edges();
        // The smallest corner of a wedge owns it
        uint32_t leader = scene::none;
        wedges_.assign(corners_.size(), scene::none);
        for (uint32_t i = 0; i < corners_.size(); ++i) {
            uint32_t& wedge = wedges_[root(i)];
            if (wedge == scene::none) {
                wedge = shared_.wedge_count();
                shared_.wedge_owner.push_back(corners_[i]);
                if (leader == scene::none) leader = wedge;
                shared_.wedge_leader.push_back(leader);
            }
            shared_.wedge_of_corner[corners_[i]] = wedge;
        }
    }

  private:
    void list_corners(int vertex) {
        corners_.clear();
        links_.clear();
        const auto faces = level_.GetVertexFaces(vertex);
        const auto places = level_.GetVertexFaceLocalIndices(vertex);
        for (int i = 0; i < faces.size(); ++i)
            if (shared_.has_face[size_t(faces[i])])
                corners_.push_back(shared_.first_corner[size_t(faces[i])] + places[i]);
        std::sort(corners_.begin(), corners_.end());
    }

    void join_along_edges() {
        for (uint32_t i = 0; i < corners_.size(); ++i) {
            const uint32_t corner = corners_[i];
            const auto after =
                std::upper_bound(shared_.first_corner.begin(), shared_.first_corner.end(), corner);
            const uint32_t first = *(after - 1), count = *after - first;
            const uint32_t previous = first + (corner - first + count - 1) % count;
            for (const uint32_t c : {corner, previous}) {
                const uint32_t edge = shared_.edge_of_corner[c];
                if (!shared_.is_split[edge]) links_.emplace_back(edge, i);
            }
        }
        std::sort(links_.begin(), links_.end());
        for (size_t i = 1; i < links_.size(); ++i)
            if (links_[i].first == links_[i - 1].first)
                join(links_[i - 1].second, links_[i].second);
    }

    uint32_t root(uint32_t i) {
        while (parents_[i] != i) i = parents_[i] = parents_[parents_[i]];
        return i;
    }

    void join(uint32_t a, uint32_t b) {
        const uint32_t ra = root(a), rb = root(b);
        parents_[std::max(ra, rb)] = std::min(ra, rb);
    }

    const Far::TopologyLevel& level_;
    SharedPoints& shared_;
    std::vector<uint32_t> corners_;                     // at the vertex, ascending
    std::vector<std::pair<uint32_t, uint32_t>> links_;  // edge, place in corners_
    std::vector<uint32_t> parents_, wedges_;
};

}  // namespace

SharedPoints find_shared_points(const Cage& cage, const scene::Mesh& mesh) {
    const Far::TopologyLevel& level = cage.refiner->GetLevel(0);
    const bool is_bilinear = mesh.subdivision == scene::SubdivisionScheme::Bilinear;
    SharedPoints shared;
    const size_t corner_count = mesh.face_vertex_indices.size();
    shared.first_corner.reserve(mesh.face_vertex_counts.size() + 1);
    shared.edge_of_corner.reserve(corner_count);
    shared.is_backward.reserve(corner_count);
    uint32_t first = 0;
    for (int f = 0; f < level.GetNumFaces(); ++f) {
        shared.first_corner.push_back(first);
        shared.has_face.push_back(cage.factory->FaceHasLimitSurface(f));
        const auto edges = level.GetFaceEdges(f);
        const auto vertices = level.GetFaceVertices(f);
        for (int i = 0; i < edges.size(); ++i) {
            shared.edge_of_corner.push_back(uint32_t(edges[i]));
            shared.is_backward.push_back(level.GetEdgeVertices(edges[i])[0] != vertices[i]);
        }
        first += uint32_t(edges.size());
    }
    shared.first_corner.push_back(first);
    for (int e = 0; e < level.GetNumEdges(); ++e)
        shared.is_split.push_back(is_discontinuous(level, e, is_bilinear));

    shared.wedge_of_corner.assign(corner_count, scene::none);
    WedgeFinder finder(level, shared);
    for (int v = 0; v < level.GetNumVertices(); ++v)
        finder.find(v, is_bilinear || level.IsVertexInfSharp(v));
    return shared;
}

}  // namespace velatura::plugins::subdivision
