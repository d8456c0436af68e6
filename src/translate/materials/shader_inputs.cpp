// SPDX-License-Identifier: Apache-2.0
#include "translate/materials/shader_inputs.h"

#include "translate/color/color_space.h"
#include "translate/context/values.h"

#include <fmt/format.h>

namespace velatura::translate::materials {

namespace {

std::string shader_id(Context& ctx, Prim shader) {
    return read_text(shader.attribute("info:id"), "", ctx.time);
}

/// One number or three as a color; false for other values.
bool read_rgb(Context& ctx, const Attribute& attribute, color::Meaning meaning, Rgb& out) {
    std::vector<float> rows;
    int width = 0;
    if (!color::read_color_rows(ctx, attribute, rows, width, meaning) || rows.empty()) return false;
    if (width >= 3 && rows.size() >= 3)
        out = Rgb(rows[0], rows[1], rows[2]);
    else
        out = Rgb(rows[0]);
    return true;
}

scene::TextureOutput texture_output(Context& ctx, const ShaderSource& source, int width) {
    if (source.output == "r") return scene::TextureOutput::R;
    if (source.output == "g") return scene::TextureOutput::G;
    if (source.output == "b") return scene::TextureOutput::B;
    if (source.output == "a") return scene::TextureOutput::A;
    if (source.output != "rgb") {
        ctx.warn("unknown-shader-output", source.shader,
                 fmt::format("UsdUVTexture has no output {}, rgb is used", source.output));
    }
    // A number takes the first channel of a color
    return width == 3 ? scene::TextureOutput::Rgb : scene::TextureOutput::R;
}

/// As shader_source; complain(code, attribute, message).
template <class Complain>
ShaderSource follow(const usd::stage::Stage& stage,
                    const Attribute& attribute,
                    const Complain& warn_color) {
    constexpr int deepest = 64;
    Attribute current = attribute;
    // The deepest that has a value serves where the end of the connections has none
    Attribute with_value;
    const auto what_is_used = [&] {
        return with_value.is_valid() ? "the value of the last connected attribute is used"
                                     : "the input keeps its default";
    };
    for (int depth = 0; depth < deepest; ++depth) {
        if (current.has_authored_value()) with_value = current;
        const auto connections = current.connections();
        const ShaderSource end{Prim(), "", with_value.is_valid() ? with_value : current};
        if (connections.empty()) return end;
        if (connections.size() > 1)
            warn_color("several-connections", current,
                       fmt::format("{} has {} connections, the first is used",
                                   current.path_string(), connections.size()));
        const usd::layer::Path target = connections[0];
        const Prim prim = stage.prim_at(target.prim_path());
        const std::string name = target.name().str();
        if (!prim || !target.is_property()) {
            warn_color("unresolved-connection", current,
                       fmt::format("connection target <{}> not found; {}", target.to_string(),
                                   what_is_used()));
            return end;
        }
        const bool is_output = name.rfind("outputs:", 0) == 0;
        if (is_output && prim.type_name() == "Shader") return {prim, name.substr(8), {}};
        current = prim.attribute(name);
    }
    warn_color("connection-cycle", attribute,
               fmt::format("connections of {} are deeper than {}, {}", attribute.path_string(),
                           deepest, what_is_used()));
    return {Prim(), "", with_value.is_valid() ? with_value : attribute};
}

}  // namespace

ShaderSource shader_source(Context& ctx, const Attribute& attribute) {
    return follow(ctx.stage, attribute,
                  [&](const char* code, const Attribute& where, std::string message) {
                      ctx.warn(code, where, std::move(message));
                  });
}

bool has_input(Prim shader, std::string_view name) {
    const Attribute input = shader.attribute("inputs:" + std::string(name));
    return input.has_authored_value() || input.has_authored_connections();
}

ShaderSource shader_source(const usd::stage::Stage& stage, const Attribute& attribute) {
    return follow(stage, attribute, [](const char*, const Attribute&, const std::string&) {});
}

bool has_fallback(Prim reader) {
    const Attribute fallback = reader.attribute("inputs:fallback");
    return fallback.has_authored_value() || fallback.has_authored_connections();
}

std::string primvar_name(Context& ctx, Prim reader) {
    const ShaderSource source = shader_source(ctx, reader.attribute("inputs:varname"));
    const std::string name = source.shader ? "" : read_text(source.value, "", ctx.time);
    if (name.empty())
        ctx.warn("no-varname", reader, "primvar reader has no varname; its fallback is used");
    return name;
}

scene::Input InputReader::read(std::string_view name,
                               const scene::Input& fallback,
                               int width,
                               color::Meaning meaning) {
    scene::Input input = fallback;
    const Attribute attribute = shader.attribute("inputs:" + std::string(name));
    if (!attribute.is_valid()) return input;
    const ShaderSource source = shader_source(ctx, attribute);
    if (!source.shader) {
        read_rgb(ctx, source.value, meaning, input.value);
        return input;
    }
    // What the input holds itself serves where the connected node cannot be read
    read_rgb(ctx, attribute, meaning, input.value);
    const std::string id = shader_id(ctx, source.shader);
    if (id == "UsdUVTexture") {
        input.source = scene::Input::Source::Texture;
        input.texture = read_texture(ctx, source.shader, entry, meaning);
        input.output = texture_output(ctx, source, width);
    } else if (id.rfind("UsdPrimvarReader_", 0) == 0) {
        const std::string primvar = primvar_name(ctx, source.shader);
        const ShaderSource otherwise =
            shader_source(ctx, source.shader.attribute("inputs:fallback"));
        input.value = Rgb(0.0f);
        if (!otherwise.shader) read_rgb(ctx, otherwise.value, meaning, input.value);
        if (primvar.empty()) return input;
        input.source = scene::Input::Source::Primvar;
        input.primvar = scene::intern_primvar(ctx.scene, primvar);
        entry.primvars.push_back(primvar);
        if (!has_fallback(source.shader)) entry.needed.push_back(primvar);
    } else {
        ctx.warn("unsupported-shader", source.shader,
                 fmt::format("shader node {} is not supported, {} keeps its constant",
                             id.empty() ? "without info:id" : id, name));
    }
    return input;
}

scene::Input InputReader::number(std::string_view name, float fallback) {
    return read(name, scene::Input(fallback), 1, color::Meaning::Number);
}

scene::Input InputReader::color(std::string_view name, const Rgb& fallback) {
    return read(name, scene::Input(fallback), 3, color::Meaning::Color);
}

scene::Input InputReader::vector(std::string_view name, const Rgb& fallback) {
    return read(name, scene::Input(fallback), 3, color::Meaning::Number);
}

double InputReader::constant_number(std::string_view name, double fallback) {
    const ShaderSource source = shader_source(ctx, shader.attribute("inputs:" + std::string(name)));
    if (!source.shader) return read_number(source.value, fallback, ctx.time);
    ctx.warn("unsupported-connection", shader.attribute("inputs:" + std::string(name)),
             fmt::format("{} cannot vary over the surface, {} is used", name, fallback));
    return fallback;
}

std::string InputReader::constant_text(std::string_view name, std::string_view fallback) {
    const ShaderSource source = shader_source(ctx, shader.attribute("inputs:" + std::string(name)));
    return source.shader ? std::string(fallback) : read_text(source.value, fallback, ctx.time);
}

}  // namespace velatura::translate::materials
