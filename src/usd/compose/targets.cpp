// SPDX-License-Identifier: Apache-2.0
#include "usd/compose/targets.h"

#include "usd/layer/fields.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace velatura::usd::compose {

using layer::Path;
using layer::SpecKind;
using layer::Token;

namespace {

enum class ListKind { Item, Deleted, Ordered };

/// Translates the targets of one property, and keeps the errors.
class TargetComposer {
  public:
    TargetComposer(const PrimIndex& index, Token property, Composer* composer)
        : index_(index), property_(property), composer_(composer) {}

    void apply(const PropertySite& site, const layer::Field& field, const layer::PathListOp& op) {
        if (!op.has_opinion()) return;
        result_.has_opinion = true;
        if (op.is_explicit) {
            // What is replaced cannot be wrong any more
            errors_.clear();
            result_.deleted.clear();
        }
        site_ = &site;
        loc_ = field.loc;
        // Deletes first: they are applied first, and take errors of weaker layers away
        layer::PathListOp mapped;
        mapped.is_explicit = op.is_explicit;
        mapped.deleted = translated(op.deleted, ListKind::Deleted);
        mapped.explicit_items = translated(op.explicit_items, ListKind::Item);
        mapped.added = translated(op.added, ListKind::Item);
        mapped.prepended = translated(op.prepended, ListKind::Item);
        mapped.appended = translated(op.appended, ListKind::Item);
        mapped.ordered = translated(op.ordered, ListKind::Ordered);
        mapped.apply_to(result_.paths);
    }

    ComposedTargets result() {
        for (Failed& failed : errors_) result_.errors.push_back(std::move(failed.error));
        return std::move(result_);
    }

  private:
    struct Failed {
        Path target;  ///< in the stage's namespace, where it has one
        CompositionError error;
    };

    const Node& node() const { return index_.graph()[site_->node]; }

    std::vector<Path> translated(const std::vector<Path>& targets, ListKind kind) {
        std::vector<Path> paths;
        for (const Path& target : targets) {
            if (const std::optional<Path> path = translate(target, kind)) paths.push_back(*path);
        }
        return paths;
    }

    std::optional<Path> translate(Path target, ListKind kind) {
        const Path path = map_to_root(node(), target);
        if (kind == ListKind::Deleted) {
            if (path.is_empty()) return std::nullopt;
            result_.deleted.push_back(path);
            std::erase_if(errors_, [&](const Failed& failed) { return failed.target == path; });
            return path;
        }
        if (path.is_empty()) {
            // The order of targets adds none
            if (kind == ListKind::Item)
                fail(ErrorKind::InvalidExternalTargetPath, path,
                     fmt::format("target <{}> of {} is outside the scope of the {} from <{}>; it "
                                 "is ignored",
                                 target.to_string(), property_.str(), arc_name(node().arc),
                                 index_.path().to_string()));
            return std::nullopt;
        }
        if (composer_ && targets_own_instance(target, path)) {
            fail(ErrorKind::InvalidInstanceTargetPath, path,
                 fmt::format("target <{}> is authored in a class but is an instance of that class",
                             target.to_string()));
            return std::nullopt;
        }
        return path;
    }

    bool targets_own_instance(Path target, Path path) const {
        if (node().arc != ArcType::Inherit) return false;
        const Path class_path = index_.graph().path_at_introduction(site_->node);
        if (target.has_prefix(class_path)) return false;
        const PrimIndex other = composer_->prim_index(path.prim_path());
        return std::any_of(other.nodes().begin(), other.nodes().end(), [&](const Node& n) {
            return n.arc == ArcType::Inherit && n.stack == node().stack &&
                   n.path.has_prefix(class_path);
        });
    }

    void fail(ErrorKind kind, Path path, std::string message) {
        const Path owner = index_.path().append_property(property_);
        errors_.push_back({path,
                           {kind, owner, node().stack->identifier(),
                            node().path.append_property(property_), std::move(message), loc_}});
    }

    const PrimIndex& index_;
    Token property_;
    Composer* composer_;
    const PropertySite* site_ = nullptr;
    SourceLoc loc_;
    std::vector<Failed> errors_;
    ComposedTargets result_;
};

}  // namespace

ComposedTargets compose_targets(const PrimIndex& index,
                                Token property,
                                std::span<const PropertySite> stack,
                                Composer* composer) {
    if (stack.empty()) return {};
    TargetComposer targets(index, property, composer);
    const bool is_attribute = stack.front().spec->kind() == SpecKind::Attribute;
    const Token name =
        is_attribute ? layer::fields().connection_paths : layer::fields().target_paths;
    for (auto site = stack.rbegin(); site != stack.rend(); ++site) {
        const layer::Field* field = site->spec->find_field(name);
        const auto* op = field ? field->value.get_if<layer::PathListOp>() : nullptr;
        if (op) targets.apply(*site, *field, *op);
    }
    return targets.result();
}

}  // namespace velatura::usd::compose
