// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "usd/layer/fields.h"
#include "usd/layer/layer.h"
#include "usd/layer/type_name.h"
#include "usd/text/list_edit.h"
#include "usd/text/metadata_parser.h"
#include "usd/text/parser_context.h"

#include <string>

namespace velatura::usd::text {

/// Reads statements on properties of prims and variants: attributes with their values, time
/// samples, splines and connections, relationships with their targets, and orders of names.
/// Functions return false after having reported what is wrong.
/// Ref: AOUSD Core Specification 1.0.1, 16.2.
class PropertyParser {
  public:
    PropertyParser(ParserContext& context, MetadataParser& metadata)
        : context_(context),
          s_(context.scanner),
          values_(context.values),
          names_(context.names),
          metadata_(metadata) {}

    /// One statement, without what ends it.
    bool parse(layer::Path owner);

  private:
    struct Declaration;

    /// The spec of a property, new or declared before; nullptr, after an error, when the earlier
    /// declaration is another.
    layer::Spec* spec_of(layer::Path owner, layer::SpecKind kind, const Declaration& declaration);
    bool attribute(layer::Path owner, Declaration& declaration);
    bool attribute_extra(layer::Path owner, layer::Spec& spec, const Declaration& declaration);
    bool attribute_value(const Declaration& declaration, layer::Value& out);
    bool attribute_samples(layer::Spec& spec, const Declaration& declaration);
    bool sample_value(const Declaration& declaration, layer::Value& out);
    /// "time :"; a time of nan is warned about.
    bool sample_time(double& time);
    bool spline(layer::Spec& spec);
    bool relationship(layer::Path owner, Declaration& declaration);
    bool relationship_extra(layer::Path owner, layer::Spec& spec, Declaration& declaration);
    bool relationship_samples(layer::Path owner, layer::Spec& spec);
    bool target_list(
        layer::Path owner, layer::Spec& spec, layer::Token field, ListEdit edit, SourceLoc where);
    bool target_path(layer::Path owner, layer::Path& out);

    ParserContext& context_;
    Scanner& s_;
    ValueParser& values_;
    const layer::FieldNames& names_;
    MetadataParser& metadata_;
};

struct PropertyParser::Declaration {
    SourceLoc where;
    ListEdit edit = ListEdit::Explicit;
    bool is_custom = false;
    layer::Variability variability = layer::Variability::Varying;
    std::string type_name;                  ///< of attributes, with "[]"
    const layer::TypeInfo* type = nullptr;  ///< nullptr: unknown
    std::string name;
};

}  // namespace velatura::usd::text
