// SPDX-License-Identifier: Apache-2.0
#include "translate/known_names.h"

#include "translate/schema_support.h"

#include <algorithm>
#include <cctype>
#include <functional>

namespace velatura::translate {

namespace {

/// Calls visit for every part of a text apart by '|', until it returns true.
bool any_part(std::string_view text, const std::function<bool(std::string_view)>& is_it) {
    for (size_t begin = 0; begin <= text.size();) {
        const size_t end = std::min(text.find('|', begin), text.size());
        if (is_it(text.substr(begin, end - begin))) return true;
        begin = end + 1;
    }
    return false;
}

/// The schema itself and those that it is derived from or has built in.
void add_schema(std::string_view schema, std::vector<std::string>& schemas) {
    for (; !schema.empty(); schema = usd::stage::schema_base(schema)) {
        if (std::find(schemas.begin(), schemas.end(), schema) != schemas.end()) return;
        schemas.emplace_back(schema);
        for (const std::string_view api : usd::stage::schema_builtin_apis(schema))
            add_schema(api, schemas);
    }
}

std::string lower(std::string_view text) {
    std::string out(text);
    std::transform(out.begin(), out.end(), out.begin(),
                   [](unsigned char c) { return char(std::tolower(c)); });
    return out;
}

bool is_api(std::string_view schema) {
    return schema.ends_with("API");
}

}  // namespace

bool is_one_of(std::string_view text, std::string_view choices) {
    return any_part(choices, [&](std::string_view choice) { return choice == text; });
}

KnownNames known_names(usd::stage::Prim prim) {
    std::vector<std::string> schemas;
    add_schema(prim.type_name().view(), schemas);
    for (const usd::layer::Token& api : prim.applied_schemas())
        add_schema(api.view().substr(0, api.view().find(':')), schemas);
    // A shader node is what its identifier says
    if (prim.type_name() == "Shader") {
        const auto id = prim.attribute("info:id").get<std::string>();
        if (id) schemas.push_back(*id);
    }
    KnownNames known;
    const auto has = [&](std::string_view schema) {
        return schema.empty() || std::find(schemas.begin(), schemas.end(), schema) != schemas.end();
    };
    for (const std::string& schema : schemas) {
        for (const usd::stage::SchemaAttribute& a : usd::stage::schema_attributes()) {
            if (a.schema == schema && known.attributes.emplace(a.name, &a).second)
                known.names.emplace_back(a.name);
        }
    }
    for (const usd::stage::SchemaRelationship& r : usd::stage::schema_relationships())
        if (has(r.schema)) known.names.emplace_back(r.name);
    for (const ExtraName& other : other_names())
        if (has(other.schema)) known.names.emplace_back(other.name);
    return known;
}

const std::vector<std::string>& known_types() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> types;
        for (const usd::stage::SchemaType& type : usd::stage::schema_types())
            if (!is_api(type.name)) types.emplace_back(type.name);
        return types;
    }();
    return names;
}

const std::vector<std::string>& known_apis() {
    static const std::vector<std::string> names = [] {
        std::vector<std::string> apis;
        for (const usd::stage::SchemaType& type : usd::stage::schema_types())
            if (is_api(type.name)) apis.emplace_back(type.name);
        return apis;
    }();
    return names;
}

bool is_without_image(std::string_view schema) {
    for (const std::string_view known : schemas_without_image()) {
        if (known == schema) return true;
        if (known.ends_with('*') && schema.starts_with(known.substr(0, known.size() - 1)))
            return true;
    }
    return false;
}

ForeignName foreign_name(std::string_view attribute) {
    ForeignName found;
    for (const ForeignRenderer& renderer : foreign_renderers()) {
        const bool is_its = any_part(renderer.prefixes, [&](std::string_view prefix) {
            return attribute.starts_with(prefix);
        });
        if (!is_its) continue;
        found.renderer = &renderer;
        break;
    }
    if (!found.renderer) return found;
    const std::string name = lower(attribute);
    for (const ForeignRequest& request : foreign_requests()) {
        const bool fits = any_part(request.words, [&](std::string_view word) {
            return name.find(word) != std::string::npos;
        });
        if (!fits) continue;
        found.request = &request;
        break;
    }
    return found;
}

}  // namespace velatura::translate
