// SPDX-License-Identifier: Apache-2.0
#include "plugins/subdivision/channels.h"

#include <algorithm>

namespace velatura::plugins::subdivision {

namespace {

/// Puts the values of a primvar, one row per element, into columns of the channel.
void fill(const scene::Primvar& primvar, const Channel::Part& part, size_t rows, Channel& channel) {
    for (size_t r = 0; r < rows; ++r) {
        const size_t row = primvar.indices.empty() ? r : primvar.indices[r];
        std::copy_n(&primvar.values[row * part.width], part.width,
                    &channel.rows[r * channel.width + part.first]);
    }
}

/// Adds columns for every primvar of the interpolation.
void add_parts(const scene::Mesh& mesh, scene::Interpolation interpolation, Channel& channel) {
    for (size_t p = 0; p < mesh.primvars.size(); ++p) {
        if (mesh.primvars[p].interpolation != interpolation) continue;
        channel.parts.push_back({p, channel.width, mesh.primvars[p].width});
        channel.width += mesh.primvars[p].width;
    }
    channel.rows.assign(channel.width * mesh.points.size(), 0.0);
    for (const Channel::Part& part : channel.parts)
        fill(mesh.primvars[part.primvar], part, mesh.points.size(), channel);
}

void fill_points(const std::vector<Vec3>& points, size_t first, Channel& channel) {
    for (size_t v = 0; v < points.size(); ++v)
        for (int k = 0; k < 3; ++k)
            channel.rows[v * channel.width + first + size_t(k)] = double(points[v][k]);
}

}  // namespace

Channels make_channels(const scene::Mesh& mesh, const Cage& cage, bool stays) {
    Channels channels;
    if (!stays) channels.keys += mesh.later_points.size();
    channels.vertex.width = 3 * channels.keys;
    add_parts(mesh, scene::Interpolation::Vertex, channels.vertex);
    fill_points(mesh.points, 0, channels.vertex);
    for (size_t k = 1; k < channels.keys; ++k)
        fill_points(mesh.later_points[k - 1], 3 * k, channels.vertex);
    add_parts(mesh, scene::Interpolation::Varying, channels.varying);
    for (const size_t p : cage.face_varying) {
        const scene::Primvar& primvar = mesh.primvars[p];
        Channel& channel = channels.face_varying.emplace_back();
        channel.width = primvar.width;
        channel.parts.push_back({p, 0, channel.width});
        channel.rows.assign(primvar.values.begin(), primvar.values.end());
    }
    return channels;
}

std::vector<scene::Primvar> Channels::primvars(const scene::Mesh& mesh, size_t points) const {
    std::vector<scene::Primvar> out;
    for (const scene::Primvar& primvar : mesh.primvars) {
        const bool stays_as_it_is = primvar.interpolation == scene::Interpolation::Constant ||
                                    primvar.interpolation == scene::Interpolation::Uniform;
        if (stays_as_it_is) {
            out.push_back(primvar);
            continue;
        }
        scene::Primvar& refined = out.emplace_back();
        refined.name = primvar.name;
        refined.interpolation = scene::Interpolation::Vertex;
        refined.width = primvar.width;
        refined.values.resize(points * primvar.width);
    }
    return out;
}

}  // namespace velatura::plugins::subdivision
