// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string_view>

namespace velatura::translate {

/// What becomes of an attribute that a schema declares (docs/reference/usd_support.md).
enum class Support : unsigned char {
    Used,      ///< reaches the image; tests/identities/schema_attributes_test.cpp renders it alone
    Warned,    ///< a warning names it where it would change the image
    NoEffect,  ///< says nothing of the image, or its prim is skipped with a warning
};

/// A declared attribute that is not used.
struct UnusedAttribute {
    std::string_view schema, attribute;
    Support support;
    /// Of Warned: what is done instead, for the warning by report_authored_names. Empty: the
    /// reader of the prim warns.
    std::string_view consequence = "";
};

/// Every attribute of usd::stage::schema_attributes() that is not here is used.
std::span<const UnusedAttribute> unused_attributes();
Support support_of(std::string_view schema, std::string_view attribute);

/// An attribute whose tokens no reader checks.
struct TokenChoice {
    std::string_view attribute;
    std::string_view tokens;       ///< apart by '|'
    std::string_view consequence;  ///< of another token
};

std::span<const TokenChoice> token_choices();

/// Attributes and relationships that are read, or of no consequence, beside those of the schemas.
struct ExtraName {
    std::string_view schema;  ///< "" = of any prim
    std::string_view name;
};

std::span<const ExtraName> other_names();

/// Schemas, typed or applied, that say nothing of the image. A '*' at the end stands for anything.
std::span<const std::string_view> schemas_without_image();

/// Attributes of other renderers.
struct ForeignRenderer {
    std::string_view name;
    std::string_view prefixes;  ///< of attribute names, apart by '|'
};

/// What attributes of other renderers ask for, by parts of their names.
struct ForeignRequest {
    std::string_view words;         ///< lower case, apart by '|'; one of them is in the name
    std::string_view neutral;       ///< values that ask for nothing, apart by '|'
    std::string_view what_is_done;  ///< empty: what it asks for is done
};

std::span<const ForeignRenderer> foreign_renderers();
/// The first whose words fit counts; a name that none fits says nothing of the image.
std::span<const ForeignRequest> foreign_requests();

}  // namespace velatura::translate
