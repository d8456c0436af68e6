// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::compositor {
inline namespace io {

/// What a color layer of another renderer holds, by its name.
enum class PassKind {
    Light,   ///< an additive part of the beauty: a row
    Beauty,  ///< the whole image, or a copy of it
    Data,    ///< albedo, normals, ids, depth, AO …: no light, or light that is no part of the sum
};

/// By the last word of a name with dots (`ViewLayer.DiffDir` of Cycles → `DiffDir`): a table of
/// the names that Cycles, Arnold, Karma, RenderMan, V-Ray, MoonRay, Redshift, LuxCore and pbrt
/// write. A name that nobody knows is light.
PassKind pass_kind(const std::string& name);

/// Among several beauties the one with the smaller rank is meant.
size_t beauty_rank(const std::string& name);

/// What comes after the view layer. All of a name whose dots mean something else, as those of a
/// light path expression do.
std::string last_word(const std::string& name);

/// True where `name` is the sum of layers that the file has too: `diffuse` of `diffuse_direct` and
/// `diffuse_indirect`. `has` tells which names there are.
template <class Has>
bool is_total(const std::string& name, const Has& has) {
    return has(name + "_direct") && has(name + "_indirect");
}

/// Light that a renderer took away, which is a row beside a beauty and no part of a sum.
bool is_shadow_pass(const std::string& name);

}  // namespace io
}  // namespace velatura::compositor
