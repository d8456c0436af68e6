// SPDX-License-Identifier: Apache-2.0
#include "usd/crate/writer.h"

#include "usd/crate/append.h"
#include "usd/crate/coding.h"
#include "usd/crate/crate_file.h"
#include "usd/crate/field_rules.h"
#include "usd/crate/packer.h"
#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

namespace velatura::usd::crate {

namespace {

using layer::Path;
using layer::PathKind;
using layer::Spec;
using layer::SpecKind;
using layer::Token;

SpecForm form_of(SpecKind kind) {
    switch (kind) {
        case SpecKind::PseudoRoot:
            return SpecForm::PseudoRoot;
        case SpecKind::Prim:
            return SpecForm::Prim;
        case SpecKind::Attribute:
            return SpecForm::Attribute;
        case SpecKind::Relationship:
            return SpecForm::Relationship;
        case SpecKind::VariantSet:
            return SpecForm::VariantSet;
        case SpecKind::Variant:
            return SpecForm::Variant;
    }
    return SpecForm::Unknown;
}

/// The last element of a path as the table of paths names it.
std::string element_text(Path path) {
    switch (path.kind()) {
        case PathKind::VariantSelection:
            return '{' + path.variant_set().str() + '=' + path.variant().str() + '}';
        case PathKind::Target:
            return '[' + path.target().to_string() + ']';
        case PathKind::Mapper:
            return ".mapper[" + path.target().to_string() + ']';
        case PathKind::Expression:
            return ".expression";
        case PathKind::RelationalAttribute:
        case PathKind::MapperArgument:
            return '.' + path.name().str();
        default:
            return path.name().str();
    }
}

class FileWriter {
  public:
    FileWriter(const layer::Layer& layer, Version version, Diagnostics& diagnostics)
        : layer_(layer), version_(version), diagnostics_(diagnostics), packer_(version) {}

    void gather() {
        layer_.for_each_spec(Path::absolute_root(),
                             [&](Path path, const Spec& spec) { add_spec(path, spec); });
    }

    Version needed() const { return packer_.needed(); }

    Result<std::string> finish();

  private:
    void add_spec(Path path, const Spec& spec);
    /// Remembers where a text with a zero byte came up first; without a field, in the names of the
    /// spec's children.
    void note_zero_byte(Path path, Token field);
    bool pack_field(const layer::Field& field, ValueRep& out);
    void add_field(std::vector<uint32_t>& set, Token name, ValueRep rep);
    void add_children(std::vector<uint32_t>& set, Token name, std::span<const Token> children);

    template <class Write>
    void section(const char* name, const Write& write) {
        const uint64_t start = packer_.out().size();
        write(packer_.out());
        sections_.push_back({name, start, packer_.out().size() - start});
    }

    static void integers(std::string& out, const std::vector<int32_t>& column) {
        std::string coded;
        encode_integers(std::span<const int32_t>(column), coded);
        append(out, uint64_t(coded.size()));
        out += coded;
    }

    void tokens(std::string& out);
    void strings(std::string& out);
    void fields(std::string& out);
    void field_sets(std::string& out);
    void paths(std::string& out);
    void specs(std::string& out);

    struct Section {
        const char* name;
        uint64_t start;
        uint64_t size;
    };

    const layer::Layer& layer_;
    Version version_;
    Diagnostics& diagnostics_;
    Packer packer_;
    std::string zero_byte_place_;
    std::vector<FieldEntry> fields_;
    std::map<std::pair<uint32_t, uint64_t>, uint32_t> field_indices_;
    std::vector<uint32_t> field_sets_;
    std::map<std::vector<uint32_t>, uint32_t> field_set_starts_;
    std::vector<SpecEntry> specs_;
    std::vector<Section> sections_;
};

void FileWriter::add_field(std::vector<uint32_t>& set, Token name, ValueRep rep) {
    const uint32_t token = packer_.token(name);
    const auto [it, is_new] = field_indices_.emplace(std::pair(token, rep.bits), fields_.size());
    if (is_new) fields_.push_back({token, rep});
    set.push_back(it->second);
}

void FileWriter::add_children(std::vector<uint32_t>& set,
                              Token name,
                              std::span<const Token> children) {
    if (!children.empty()) add_field(set, name, packer_.pack_names(children));
}

bool FileWriter::pack_field(const layer::Field& field, ValueRep& out) {
    const layer::FieldNames& names = layer::fields();
    const bool is_list = field.name == names.sub_layers || field.name == names.prim_order ||
                         field.name == names.property_order;
    return is_list ? packer_.pack_vector(field.value, out) : packer_.pack(field.value, out);
}

void FileWriter::note_zero_byte(Path path, Token field) {
    if (!packer_.has_zero_byte() || !zero_byte_place_.empty()) return;
    const std::string part =
        field.empty() ? "the names below" : fmt::format("field '{}' of", field.str());
    zero_byte_place_ = fmt::format("{} <{}>", part, path.to_string());
}

void FileWriter::add_spec(Path path, const Spec& spec) {
    std::vector<uint32_t> set;
    for (const layer::Field& field : spec.fields()) {
        ValueRep rep;
        const bool is_packed = pack_field(field, rep);
        if (is_packed) add_field(set, field.name, rep);
        note_zero_byte(path, field.name);
        if (is_packed) continue;
        diagnostics_.warn(
            "usd-crate-unwritable", field.loc, path.to_string(),
            fmt::format("found a value of field '{}' whose type .usdc cannot store; it is skipped",
                        field.name.str()));
    }
    // Relationships that do not say are uniform in text but varying in crates
    const Token variability = layer::fields().variability;
    if (spec.kind() == SpecKind::Relationship && !spec.has_field(variability)) {
        ValueRep rep;
        packer_.pack(layer::Value(layer::Variability::Uniform), rep);
        add_field(set, variability, rep);
    }
    const ChildFields& children = child_fields();
    const bool is_set = spec.kind() == SpecKind::VariantSet;
    add_children(set, children.prims, spec.prim_children());
    add_children(set, children.properties, spec.properties());
    add_children(set, is_set ? children.variants : children.variant_sets, spec.variant_sets());
    note_zero_byte(path, {});
    const auto [it, is_new] = field_set_starts_.emplace(set, uint32_t(field_sets_.size()));
    if (is_new) {
        field_sets_.insert(field_sets_.end(), set.begin(), set.end());
        field_sets_.push_back(field_set_end);
    }
    specs_.push_back({packer_.path(path), it->second, uint32_t(form_of(spec.kind()))});
}

void FileWriter::tokens(std::string& out) {
    std::string text;
    for (const Token token : packer_.tokens()) {
        text += token.str();
        text += '\0';
    }
    std::string compressed;
    compress(text, compressed);
    append(out, uint64_t(packer_.tokens().size()));
    append(out, uint64_t(text.size()));
    append(out, uint64_t(compressed.size()));
    out += compressed;
}

void FileWriter::strings(std::string& out) {
    append(out, uint64_t(packer_.strings().size()));
    for (const uint32_t token : packer_.strings()) append(out, token);
}

void FileWriter::fields(std::string& out) {
    std::vector<int32_t> names;
    std::string values;
    for (const FieldEntry& f : fields_) {
        names.push_back(int32_t(f.token));
        append(values, f.value.bits);
    }
    std::string compressed;
    compress(values, compressed);
    append(out, uint64_t(fields_.size()));
    integers(out, names);
    append(out, uint64_t(compressed.size()));
    out += compressed;
}

void FileWriter::field_sets(std::string& out) {
    append(out, uint64_t(field_sets_.size()));
    integers(out, {field_sets_.begin(), field_sets_.end()});
}

void FileWriter::paths(std::string& out) {
    // In namespace order a path's descendants follow it
    std::vector<Path> sorted;
    for (const Path p : packer_.paths()) {
        if (p.is_absolute()) sorted.push_back(p);
    }
    std::sort(sorted.begin(), sorted.end());
    const size_t n = sorted.size();
    std::vector<int32_t> indices(n);
    std::vector<int32_t> elements(n);
    std::vector<int32_t> jumps(n, -2);
    // The last path seen so far at each depth: the sibling before, once another of its depth comes
    std::vector<size_t> open;
    for (size_t i = 0; i < n; ++i) {
        const Path p = sorted[i];
        const size_t depth = p.element_count();
        indices[i] = int32_t(packer_.path_index(p));
        const auto token = depth == 0 ? int32_t(0) : int32_t(packer_.token(Token(element_text(p))));
        elements[i] = p.kind() == PathKind::Property ? -token : token;
        if (depth < open.size()) {
            const size_t before = open[depth];
            jumps[before] = jumps[before] == -1 ? int32_t(i - before) : 0;
        } else if (depth > 0) {
            jumps[open[depth - 1]] = -1;
        }
        open.resize(depth);
        open.push_back(i);
    }
    append(out, uint64_t(packer_.paths().size()));
    append(out, uint64_t(n));
    integers(out, indices);
    integers(out, elements);
    integers(out, jumps);
}

void FileWriter::specs(std::string& out) {
    append(out, uint64_t(specs_.size()));
    std::vector<int32_t> column(specs_.size());
    for (uint32_t SpecEntry::*member :
         {&SpecEntry::path, &SpecEntry::field_set, &SpecEntry::form}) {
        for (size_t i = 0; i < specs_.size(); ++i) column[i] = int32_t(specs_[i].*member);
        integers(out, column);
    }
}

Result<std::string> FileWriter::finish() {
    if (packer_.has_zero_byte()) {
        return Error{"usd-crate-write",
                     fmt::format("{}: found a text with a zero byte in {}, expected none",
                                 layer_.identifier(), zero_byte_place_)};
    }
    std::string& out = packer_.out();
    // The names of path elements are tokens too
    std::string path_section;
    paths(path_section);
    section("TOKENS", [&](std::string& o) { tokens(o); });
    section("STRINGS", [&](std::string& o) { strings(o); });
    section("FIELDS", [&](std::string& o) { fields(o); });
    section("FIELDSETS", [&](std::string& o) { field_sets(o); });
    section("PATHS", [&](std::string& o) { o += path_section; });
    section("SPECS", [&](std::string& o) { specs(o); });
    const uint64_t contents = out.size();
    append(out, uint64_t(sections_.size()));
    for (const Section& s : sections_) {
        std::string name = s.name;
        name.resize(16, '\0');
        out += name;
        append(out, s.start);
        append(out, s.size);
    }
    std::string head(crate_magic);
    head += char(version_.major_number);
    head += char(version_.minor_number);
    head += char(version_.patch_number);
    head.resize(16, '\0');
    append(head, contents);
    out.replace(0, head.size(), head);
    return std::move(out);
}

}  // namespace

Result<std::string> write_crate_layer(const layer::Layer& layer,
                                      Diagnostics& diagnostics,
                                      const CrateWriteOptions& options) {
    Version version = options.version;
    if (version < Version{0, 4, 0} || version > Version{0, 13, 0}) {
        return Error{"usd-crate-write",
                     fmt::format("found version {}.{}.{} to write, expected 0.4 to 0.13",
                                 version.major_number, version.minor_number, version.patch_number)};
    }
    // How values are stored depends on the version, and the version on what is stored
    Diagnostics first_pass(diagnostics);
    FileWriter first(layer, version, first_pass);
    first.gather();
    if (first.needed() == version) {
        first_pass.forward();
        return first.finish();
    }
    version = first.needed();
    FileWriter second(layer, version, diagnostics);
    second.gather();
    return second.finish();
}

}  // namespace velatura::usd::crate
