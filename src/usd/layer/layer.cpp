// SPDX-License-Identifier: Apache-2.0
#include "usd/layer/layer.h"

#include "base/check.h"
#include "usd/layer/fields.h"

#include <algorithm>

namespace velatura::usd::layer {

namespace {

struct ByName {
    bool operator()(const Field& f, Token name) const { return f.name < name; }
};

}  // namespace

const Field* Spec::find_field(Token name) const {
    // A few pointers: comparing them all beats comparing texts
    for (const Field& f : fields_) {
        if (f.name == name) return &f;
    }
    return nullptr;
}

SourceLoc Spec::field_loc(Token name) const {
    const Field* f = find_field(name);
    return f && f->loc.is_known() ? f->loc : loc_;
}

Specifier Spec::specifier() const {
    const Specifier* s = field_as<Specifier>(layer::fields().specifier);
    return s ? *s : Specifier::Over;
}

Token Spec::type_name() const {
    const Token* t = field_as<Token>(layer::fields().type_name);
    return t ? *t : Token();
}

bool Spec::is_custom() const {
    const bool* c = field_as<bool>(layer::fields().custom);
    return c && *c;
}

Variability Spec::variability() const {
    const Variability* v = field_as<Variability>(layer::fields().variability);
    if (v) return *v;
    return kind_ == SpecKind::Relationship ? Variability::Uniform : Variability::Varying;
}

void Spec::set_field(Token name, Value value, SourceLoc loc) {
    const auto it = std::lower_bound(fields_.begin(), fields_.end(), name, ByName());
    if (it != fields_.end() && it->name == name) {
        it->value = std::move(value);
        it->loc = loc;
    } else {
        if (fields_.capacity() == 0) {
            fields_.reserve(2);
            fields_.push_back(Field{name, std::move(value), loc});
            return;
        }
        fields_.insert(it, Field{name, std::move(value), loc});
    }
}

Layer::Layer(std::string identifier) : identifier_(std::move(identifier)) {
    root_ = &add_entry(Path::absolute_root(), SpecKind::PseudoRoot, {});
}

Spec& Layer::add_entry(Path path, SpecKind kind, SourceLoc loc) {
    Entry& entry = entries_.emplace_back(Entry{path, Spec(kind, loc)});
    index_.insert(mix64(path.hash()), &entry);
    ++spec_count_;
    return entry.spec;
}

void Layer::erase_spec(Path path) {
    Entry* entry = find(path);
    if (!entry) return;
    *entry = Entry{};
    --spec_count_;
}

Spec& Layer::create_spec_unlisted(Path path, SpecKind kind, SourceLoc loc) {
    VELATURA_CHECK(path.is_absolute(), "specs live at absolute paths");
    Spec* known = spec(path);
    return known ? *known : add_entry(path, kind, loc);
}

Spec& Layer::create_spec(Path path, SpecKind kind, SourceLoc loc) {
    VELATURA_CHECK(path.is_absolute(), "specs live at absolute paths");
    if (Spec* known = spec(path)) return *known;
    Spec& added = add_entry(path, kind, loc);
    // A variant's parent is its set; a set's is the prim or variant it belongs to
    Path parent_path = path.parent();
    if (kind == SpecKind::Variant) {
        parent_path = parent_path.append_variant_selection(path.variant_set(), Token());
    }
    Spec* parent = spec(parent_path);
    VELATURA_CHECK(parent != nullptr, "a spec's parent must exist");
    switch (kind) {
        case SpecKind::Prim:
            parent->add_prim_child(path.name());
            break;
        case SpecKind::Attribute:
        case SpecKind::Relationship:
            parent->add_property(path.name());
            break;
        case SpecKind::VariantSet:
            parent->add_variant_child(path.variant_set());
            break;
        case SpecKind::Variant:
            parent->add_variant_child(path.variant());
            break;
        case SpecKind::PseudoRoot:
            break;
    }
    return added;
}

void Layer::for_each_spec(Path from, const std::function<void(Path, const Spec&)>& visit) const {
    // An explicit stack: namespaces may be deeper than the call stack
    std::vector<Path> pending{from};
    while (!pending.empty()) {
        const Path path = pending.back();
        pending.pop_back();
        const Spec* s = spec(path);
        if (!s) continue;
        visit(path, *s);
        std::vector<Path> below;
        for (const Token name : s->properties()) below.push_back(path.append_property(name));
        if (s->kind() == SpecKind::VariantSet) {
            for (const Token v : s->variants()) {
                below.push_back(path.parent().append_variant_selection(path.variant_set(), v));
            }
        } else {
            for (const Token set : s->variant_sets()) {
                below.push_back(path.append_variant_selection(set, Token()));
            }
        }
        for (const Token name : s->prim_children()) below.push_back(path.append_child(name));
        pending.insert(pending.end(), below.rbegin(), below.rend());
    }
}

Path Layer::default_prim() const {
    const Token* name = root_->field_as<Token>(layer::fields().default_prim);
    if (!name || name->empty()) return {};
    const Path path = Path::from(name->view());
    const Path absolute = path.make_absolute(Path::absolute_root());
    return absolute.is_prim() && !absolute.has_variant_selection() ? absolute : Path();
}

std::vector<SubLayer> Layer::sub_layers() const {
    std::vector<SubLayer> result;
    const Field* assets = root_->find_field(layer::fields().sub_layers);
    if (!assets) return result;
    const auto* offsets =
        root_->field_as<std::vector<LayerOffset>>(layer::fields().sub_layer_offsets);
    const auto add = [&](const std::string& asset) {
        const size_t i = result.size();
        const bool has_offset = offsets && i < offsets->size();
        result.push_back({asset, has_offset ? (*offsets)[i] : LayerOffset{}, assets->loc});
    };
    for (const std::string& asset : assets->value.as_array<std::string>()) add(asset);
    for (const AssetPath& asset : assets->value.as_array<AssetPath>()) add(asset.path);
    return result;
}

double Layer::time_codes_per_second() const {
    const FieldNames& names = layer::fields();
    for (const Token name : {names.time_codes_per_second, names.frames_per_second}) {
        const double* rate = root_->field_as<double>(name);
        if (rate && *rate > 0.0) return *rate;
    }
    return 24.0;
}

bool Layer::has_time_codes_per_second() const {
    const FieldNames& names = layer::fields();
    return root_->has_field(names.time_codes_per_second) ||
           root_->has_field(names.frames_per_second);
}

const Relocates* Layer::relocates() const {
    return root_->field_as<Relocates>(layer::fields().layer_relocates);
}

const Dictionary* Layer::expression_variables() const {
    return root_->field_as<Dictionary>(layer::fields().expression_variables);
}

}  // namespace velatura::usd::layer
