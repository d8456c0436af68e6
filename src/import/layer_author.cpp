// SPDX-License-Identifier: Apache-2.0
#include "import/layer_author.h"

#include "usd/layer/fields.h"

namespace velatura::import {

namespace layer = usd::layer;
using layer::fields;
using layer::Token;

std::string valid_name(std::string_view name, std::string_view otherwise) {
    std::string out;
    for (size_t at = 0; at < name.size();) {
        size_t length = 1;
        const uint32_t c = layer::decode_utf8(name, at, length);
        const bool is_good = c == '_' || layer::is_xid_continue(c);
        if (out.empty() && is_good && c != '_' && !layer::is_xid_start(c)) out += '_';
        out += is_good ? std::string(name.substr(at, length)) : "_";
        at += length;
    }
    const bool says_something = out.find_first_not_of('_') != std::string::npos;
    return says_something && layer::is_identifier(out) ? out : std::string(otherwise);
}

Path LayerAuthor::define(Path parent,
                         std::string_view wanted_name,
                         std::string_view type,
                         layer::Specifier specifier) {
    const std::string base = valid_name(wanted_name, type.empty() ? "Prim" : type);
    Path path = parent.append_child(base);
    if (layer_.has_spec(path)) {
        int& number = next_number_[path];
        Path numbered;
        do {
            numbered = parent.append_child(base + "_" + std::to_string(++number));
        } while (layer_.has_spec(numbered));
        path = numbered;
    }
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Prim, {});
    spec.set_field(fields().specifier, Value(specifier), {});
    if (!type.empty()) spec.set_field(fields().type_name, Value(Token(type)), {});
    if (!wanted_name.empty() && path.name() != wanted_name)
        spec.set_field(Token("displayName"), Value(std::string(wanted_name)), {});
    return path;
}

void LayerAuthor::metadata(Path spec, std::string_view name, Value value) {
    layer_.spec(spec)->set_field(Token(name), std::move(value), {});
}

void LayerAuthor::stage_metadata(std::string_view name, Value value) {
    layer_.pseudo_root().set_field(Token(name), std::move(value), {});
}

Path LayerAuthor::declare(Path prim, std::string_view name, std::string_view type) {
    const Path path = prim.append_property(name);
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Attribute, {});
    spec.set_field(fields().type_name, Value(Token(type)), {});
    return path;
}

Path LayerAuthor::attribute(Path prim, std::string_view name, std::string_view type, Value value) {
    const Path path = declare(prim, name, type);
    metadata(path, fields().default_value.view(), std::move(value));
    return path;
}

Path LayerAuthor::uniform(Path prim, std::string_view name, std::string_view type, Value value) {
    const Path path = attribute(prim, name, type, std::move(value));
    metadata(path, fields().variability.view(), Value(layer::Variability::Uniform));
    return path;
}

void LayerAuthor::interpolated(Path prim,
                               std::string_view name,
                               std::string_view type,
                               std::string_view interpolation,
                               Value value) {
    metadata(attribute(prim, name, type, std::move(value)), fields().interpolation.view(),
             Value(Token(interpolation)));
}

void LayerAuthor::connect(Path prim, std::string_view name, std::string_view type, Path source) {
    metadata(declare(prim, name, type), fields().connection_paths.view(),
             Value(layer::PathListOp::make_explicit({source})));
}

void LayerAuthor::relationship(Path prim, std::string_view name, Path target) {
    const Path path = prim.append_property(name);
    layer::Spec& spec = layer_.create_spec(path, layer::SpecKind::Relationship, {});
    spec.set_field(fields().target_paths, Value(layer::PathListOp::make_explicit({target})), {});
}

void LayerAuthor::apply_schema(Path prim, std::string_view schema) {
    layer::Spec& spec = *layer_.spec(prim);
    layer::TokenListOp op;
    if (const auto* old = spec.field_as<layer::TokenListOp>(fields().api_schemas)) op = *old;
    op.prepended.push_back(Token(schema));
    spec.set_field(fields().api_schemas, Value(std::move(op)), {});
}

void LayerAuthor::token(Path prim, std::string_view name, std::string_view value) {
    attribute(prim, name, "token", Value(Token(value)));
}

void LayerAuthor::uniform_token(Path prim, std::string_view name, std::string_view value) {
    uniform(prim, name, "token", Value(Token(value)));
}

}  // namespace velatura::import
