// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "translate/context/context.h"
#include "translate/materials/materials.h"
#include "translate/materials/node_graph.h"
#include "translate/materials/pattern_builder.h"

#include <span>
#include <string_view>

namespace velatura::translate::materials {

/// Whether a surface shader is one that read_node_surface can read.
bool is_node_surface(std::string_view id);

/// A surface shader of MaterialX as a material: standard_surface, open_pbr_surface, gltf_pbr,
/// surface_unlit or UsdPreviewSurface. What is not simulated costs a warning at the shader.
scene::Material read_node_surface(Context& ctx,
                                  Prim shader,
                                  std::string_view id,
                                  MaterialEntry& entry);

/// `displacement` of a MaterialX displacement shader.
scene::Input read_node_displacement(Context& ctx, Prim shader, MaterialEntry& entry);

/// Reads the inputs of one surface shader.
struct SurfaceReader {
    NodeGraphReader graph;
    Prim shader;

    PatternBuilder& builder() { return graph.builder; }

    Port number(std::string_view name, float otherwise) {
        return graph.input(shader, name, builder().constant(otherwise));
    }

    Port color(std::string_view name, const Rgb& otherwise) {
        return graph.input(shader, name, builder().color(otherwise));
    }

    /// Three numbers that are no color: radii, coefficients.
    Port numbers(std::string_view name, const Rgb& otherwise) {
        return graph.numbers(shader, name, builder().color(otherwise));
    }

    /// stand_in: Input::value where it varies.
    scene::Input finish(Port p, const Rgb& varying_value = Rgb(0.0f)) {
        return graph.finish(shader, p, varying_value);
    }

    bool can_be_positive(Port p) const;
    /// Whether the shader says something of the input, be it the default.
    bool is_authored(std::string_view name) const;
    /// Warns when an input that nothing is made of says something.
    void reject(std::string_view name, float neutral);
    /// Tells the plan of an effect that the shader authors so that it does nothing.
    void note_neutral(std::string_view name, Port p, scene::Effect effect);
    void reject_connected(std::string_view name);
    void warn_unknown(std::span<const std::string_view> known);
    /// What `transmission_scatter` and its anisotropy say of the inside, where there is one.
    void read_scatter(scene::Material& m);
    /// The reflectances of metal and a factor of both, which a film keeps apart.
    void read_metal(Port f0, Port f90, Port tint, scene::Material& m);

    struct NamedDefault {
        std::string_view name;  ///< empty: it is the default
        float value;
    };

    /// A thin film, unless it is constant and of no weight or thickness. Before read_metal().
    /// to_micrometers: factor of the thickness.
    void read_film(const NamedDefault& weight,
                   const NamedDefault& thickness,
                   const NamedDefault& ior,
                   Port to_micrometers,
                   scene::Material& m);
    /// Dispersion by the Abbe number of an input, which 0 means none of; scale: divides it.
    void read_abbe_number(std::string_view name,
                          double otherwise,
                          double scale,
                          scene::Material& m);
    /// The normal of the surface from a normalmap node, in tangent space.
    scene::Input normal(std::string_view name);
};

scene::Material read_standard_surface(SurfaceReader& s);
scene::Material read_open_pbr_surface(SurfaceReader& s);
scene::Material read_gltf_surface(SurfaceReader& s);
scene::Material read_unlit_surface(SurfaceReader& s);

/// Grazing reflectance with which Schlick's formula gives `at_82` at a cosine of 1/7, where the
/// models of metal have their second color; in [0, 1].
Port schlick_f90(PatternBuilder& b, Port f0, Port at_82);

}  // namespace velatura::translate::materials
