// SPDX-License-Identifier: Apache-2.0
#include "usd/stage/dump.h"

#include "base/package_path.h"
#include "usd/layer/fields.h"
#include "usd/layer/type_name.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <map>
#include <set>
#include <type_traits>

namespace velatura::usd::stage {

using layer::Path;
using layer::Token;
using layer::Value;
using layer::ValueType;

namespace {

std::string quote_text(std::string_view text) {
    std::string out = "\"";
    for (const char c : text) {
        switch (c) {
            case '"':
                out += "\\\"";
                break;
            case '\\':
                out += "\\\\";
                break;
            case '\n':
                out += "\\n";
                break;
            case '\t':
                out += "\\t";
                break;
            case '\r':
                out += "\\r";
                break;
            default:
                if (static_cast<unsigned char>(c) < 0x20) {
                    out += fmt::format("\\u{:04x}", int(c));
                } else {
                    out += c;
                }
        }
    }
    return out + "\"";
}

std::string number(double v, int digits) {
    if (std::isnan(v)) return "nan";
    if (std::isinf(v)) return v < 0.0 ? "-inf" : "inf";
    return fmt::format("{:.{}g}", v, digits);
}

// How each type prints; tuples of any size go through their components

std::string print(bool v) {
    return v ? "true" : "false";
}

std::string print(uint8_t v) {
    return std::to_string(int(v));
}

std::string print(int32_t v) {
    return std::to_string(v);
}

std::string print(uint32_t v) {
    return std::to_string(v);
}

std::string print(int64_t v) {
    return std::to_string(v);
}

std::string print(uint64_t v) {
    return std::to_string(v);
}

std::string print(layer::Float16 v) {
    return number(double(float(v)), 9);
}

std::string print(float v) {
    return number(double(v), 9);
}

std::string print(double v) {
    return number(v, 17);
}

std::string print(const layer::TimeCodeValue& v) {
    return number(v.value, 17);
}

std::string print(const std::string& v) {
    return quote_text(v);
}

std::string print(const Token& v) {
    return quote_text(v.str());
}

std::string print(const layer::AssetPath& v) {
    return "@" + v.path + "@";
}

std::string print(const layer::PathExpression& v) {
    return quote_text(v.text);
}

std::string print(const layer::OpaqueValue&) {
    return "opaque";
}

std::string print(const layer::UnregisteredValue& v) {
    return "<SdfUnregisteredValue>" + quote_text(v.text);
}

std::string print(const Path& v) {
    return "<" + v.to_string() + ">";
}

template <class T>
std::string tuple(const T* first, int count) {
    std::string out = "(";
    for (int i = 0; i < count; ++i) out += (i ? ", " : "") + print(first[i]);
    return out + ")";
}

template <class T>
std::string print(const Imath::Vec2<T>& v) {
    return tuple(&v.x, 2);
}

template <class T>
std::string print(const Imath::Vec3<T>& v) {
    return tuple(&v.x, 3);
}

template <class T>
std::string print(const Imath::Vec4<T>& v) {
    return tuple(&v.x, 4);
}

template <class T>
std::string print(const Imath::Quat<T>& q) {
    return "(" + print(q.r) + ", " + print(q.v.x) + ", " + print(q.v.y) + ", " + print(q.v.z) + ")";
}

template <class M>
std::string print_matrix(const M& m, int size) {
    std::string out = "(";
    for (int i = 0; i < size; ++i) out += (i ? ", " : "") + tuple(m.x[i], size);
    return out + ")";
}

std::string print(const layer::Mat2d& m) {
    return print_matrix(m, 2);
}

std::string print(const layer::Mat3d& m) {
    return print_matrix(m, 3);
}

std::string print(const layer::Mat4d& m) {
    return print_matrix(m, 4);
}

/// Long lists print as count, hash of the whole text, first two items.
std::string listed(const std::vector<std::string>& items) {
    std::string text = "[";
    for (size_t i = 0; i < items.size(); ++i) text += (i ? ", " : "") + items[i];
    text += "]";
    if (items.size() <= 64) return text;
    uint64_t hash = 1469598103934665603ull;
    for (const char c : text)
        hash = (hash ^ uint64_t(static_cast<unsigned char>(c))) * 1099511628211ull;
    return fmt::format("#{}:{:016x}[{}, {}, ...]", items.size(), hash, items[0], items[1]);
}

template <class T>
std::string print_array(const Value& value) {
    std::vector<std::string> items;
    for (const T& element : value.as_array<T>()) items.push_back(print(element));
    return listed(items);
}

std::string print(const layer::Dictionary& d) {
    std::string out = "{";
    for (const auto& entry : d.entries) {
        out += (out.size() > 1 ? ", " : "") + quote_text(entry.first) + ": " +
               dump_value(entry.second);
    }
    return out + "}";
}

template <class T>
std::string print_list_op(const layer::ListOp<T>& op) {
    const auto items = [](const std::vector<T>& list) {
        std::vector<std::string> texts;
        for (const T& item : list) texts.push_back(print(item));
        return listed(texts);
    };
    if (op.is_explicit) return "<explicit " + items(op.explicit_items) + ">";
    std::string out;
    const auto add = [&](const char* name, const std::vector<T>& list) {
        if (!list.empty()) out += (out.empty() ? "" : " ") + std::string(name) + "=" + items(list);
    };
    add("add", op.added);
    add("prepend", op.prepended);
    add("append", op.appended);
    add("delete", op.deleted);
    add("order", op.ordered);
    return "<" + out + ">";
}

template <size_t I = 0>
std::string print_attribute_value(const Value& value) {
    using T = std::tuple_element_t<I, layer::ValueTypeList>;
    if (value.holds<T>()) return print(*value.get_if<T>());
    if (value.holds_array<T>()) return print_array<T>(value);
    if constexpr (I < size_t(ValueType::Matrix4d)) {
        return print_attribute_value<I + 1>(value);
    } else {
        return "";
    }
}

std::string path_list(const std::vector<Path>& paths) {
    std::vector<std::string> items;
    for (const Path& path : paths) items.push_back(print(path));
    std::string text = "[";
    for (size_t i = 0; i < items.size(); ++i) text += (i ? ", " : "") + items[i];
    return text + "]";
}

const char* specifier_name(layer::Specifier s) {
    return s == layer::Specifier::Def ? "def" : s == layer::Specifier::Class ? "class" : "over";
}

template <class Names>
std::string name_list(const Names& names) {
    std::string text = "[";
    for (const auto& name : names) text += (text.size() > 1 ? ", " : "") + name.str();
    return text + "]";
}

class Dumper {
  public:
    explicit Dumper(const Stage& stage) : stage_(stage) {}

    std::string run() {
        for (const std::string& key : stage_.metadata_keys()) {
            if (const auto value = stage_.metadata(key))
                line("/ meta {} = {}", key, dump_value(*value));
        }
        std::vector<Prim> open = stage_.pseudo_root().all_children();
        std::reverse(open.begin(), open.end());
        while (!open.empty()) {
            const Prim prim = open.back();
            open.pop_back();
            dump_prim(prim);
            const std::vector<Prim> children = prim.all_children();
            open.insert(open.end(), children.rbegin(), children.rend());
        }
        dump_errors();
        return std::move(text_);
    }

  private:
    template <class... Args>
    void line(const char* format, Args&&... args) {
        text_ += fmt::format(fmt::runtime(format), std::forward<Args>(args)...);
        text_ += '\n';
    }

    /// Base name of a layer; the root layer of a package goes by the package's name.
    std::string layer_name(const std::string& identifier) {
        auto [known, is_new] = layer_names_.emplace(identifier, "");
        if (!is_new) return known->second;
        std::vector<std::string> parts = split_package_path(identifier);
        if (parts.size() > 1) {
            const std::string inner = parts.back();
            parts.pop_back();
            const std::string package = join_package_path(parts);
            const bool is_root = stage_.package_root_layer(package) == identifier;
            known->second = std::filesystem::path(is_root ? package : inner).filename().string();
        } else {
            known->second = std::filesystem::path(identifier).filename().string();
        }
        return known->second;
    }

    void dump_errors() {
        std::set<std::string> composition;
        for (const compose::CompositionError& error : stage_.composition_errors()) {
            line("COMPERR {}", quote_text(error.message));
            composition.insert(error.message);
        }
        for (const Diagnostic& d : stage_.diagnostics().all()) {
            if (d.severity == Severity::Error && composition.count(d.message) == 0)
                line("ERR {}", quote_text(d.message));
        }
    }

    void dump_prim(const Prim& prim) {
        const std::string path = prim.path_string();
        if (!prim.is_active()) {
            line("{} prim INACTIVE {} \"{}\"", path, specifier_name(prim.specifier()),
                 prim.type_name().str());
            return;
        }
        line("{} prim {} \"{}\" defined={} abstract={} loaded={} instance={} model={}", path,
             specifier_name(prim.specifier()), prim.type_name().str(), int(prim.is_defined()),
             int(prim.is_abstract()), int(prim.is_loaded()), int(prim.is_instance()),
             int(prim.is_model()));
        std::vector<Token> names;
        for (const Prim& child : prim.all_children()) names.push_back(child.name());
        if (!names.empty()) line("{} children {}", path, name_list(names));
        for (const Prim::SpecSite& site : prim.prim_stack()) {
            line("{} spec {} {}", path, layer_name(site.layer), site.path);
        }
        const auto apis = prim.applied_schemas();
        if (!apis.empty()) line("{} api {}", path, name_list(apis));
        for (const std::string& key : prim.metadata_keys()) {
            if (const auto value = prim.metadata(key))
                line("{} meta {} = {}", path, key, dump_value(*value));
        }
        for (const auto& selection : prim.variant_selections()) {
            line("{} variant {} = {}", path, selection.first, quote_text(selection.second));
        }
        for (const Token& name : prim.property_names()) {
            const Attribute attribute = prim.attribute(name.view());
            if (attribute.is_authored()) {
                dump_attribute(attribute);
            } else {
                dump_relationship(prim.relationship(name.view()));
            }
        }
    }

    void dump_attribute(const Attribute& a) {
        const std::string path = a.path_string();
        line("{} attr {}{}{}", path, a.is_custom() ? "custom " : "",
             a.is_uniform() ? "uniform " : "", a.type_name().str());
        auto value = a.authored_default();
        if (value && (value->is_block() || value->is_animation_block())) value.reset();
        const std::vector<double> times = a.time_samples();
        if (value) line("{} default = {}", path, dump_value(*value));
        if (!value && times.empty()) line("{} novalue", path);
        for (size_t i = 0; i < times.size() && i < 200; ++i) {
            line("{} ts {} = {}", path, number(times[i], 17), dump_value(a.sample_at(times[i])));
        }
        if (times.size() > 200) line("{} ts ... {}", path, times.size());
        if (a.has_authored_connections()) line("{} connect {}", path, path_list(a.connections()));
        for (const std::string& key : a.metadata_keys()) {
            if (const auto m = a.metadata(key)) line("{} meta {} = {}", path, key, dump_value(*m));
        }
    }

    void dump_relationship(const Relationship& r) {
        const std::string path = r.path_string();
        line("{} rel {}{}", path, r.is_custom() ? "custom " : "", path_list(r.targets()));
        for (const std::string& key : r.metadata_keys()) {
            if (const auto m = r.metadata(key)) line("{} meta {} = {}", path, key, dump_value(*m));
        }
    }

    const Stage& stage_;
    std::string text_;
    std::map<std::string, std::string> layer_names_;
};

}  // namespace

std::string dump_value(const Value& value) {
    if (value.is_block() || value.is_animation_block()) return "None";
    if (layer::is_attribute_type(value.type())) return print_attribute_value(value);
    if (const auto* d = value.get_if<layer::Dictionary>()) return print(*d);
    if (const auto* op = value.get_if<layer::TokenListOp>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::StringListOp>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::PathListOp>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::ListOp<int32_t>>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::ListOp<uint32_t>>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::ListOp<int64_t>>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::ListOp<uint64_t>>()) return print_list_op(*op);
    if (const auto* op = value.get_if<layer::ListOp<layer::UnregisteredValue>>())
        return print_list_op(*op);
    if (const auto* path = value.get_if<Path>()) return print(*path);
    if (const auto* s = value.get_if<layer::Specifier>()) return quote_text(specifier_name(*s));
    if (const auto* p = value.get_if<layer::Permission>()) {
        return *p == layer::Permission::Public ? "<SdfPermission>\"SdfPermissionPublic\""
                                               : "<SdfPermission>\"SdfPermissionPrivate\"";
    }
    if (const auto* u = value.get_if<layer::UnregisteredValue>()) return print(*u);
    return "?";
}

std::string dump_stage(const Stage& stage) {
    return Dumper(stage).run();
}

}  // namespace velatura::usd::stage
