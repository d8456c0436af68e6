// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/math.h"
#include "scene/texture.h"
#include "translate/context/context.h"

#include <initializer_list>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace velatura::translate::lights {

/// A texture that a filter names.
struct FilterTexture {
    std::string file;  ///< resolved path
    scene::TexelColors colors;
};

/// Parameters of a light filter, by the names that their renderer has for them. In USD these have
/// prefixes: "inputs:ri:lightFilter:width", "inputs:width", "moonray:width", "ri:density" and
/// "width" are all called "width", or "density". Every reader takes several names: the first that
/// is authored counts.
class FilterInputs {
  public:
    using Names = std::initializer_list<const char*>;

    /// filter: names the messages; owner: has the attributes, the filter or a shader of it.
    FilterInputs(Context& ctx, Prim filter, Prim owner);

    bool has(Names names) const;
    double number(Names names, double fallback);
    bool flag(Names names, bool fallback);
    Vec2 pair(Names names, const Vec2& fallback);
    Rgb color(Names names, const Rgb& fallback);
    std::vector<float> numbers(Names names);
    std::vector<Rgb> colors(Names names);
    std::optional<Mat4d> matrix(Names names);
    /// Number of a choice, authored as that or as one of `choices`.
    int choice(Names names, std::initializer_list<const char*> choices, int fallback);
    /// An asset, a file's name, or a connection to a shader that reads one; nothing: none is
    /// authored.
    std::optional<FilterTexture> texture(Names names);

    /// Warns when a value is authored that is not `neutral`: the parameter is not supported.
    /// consequence: what the image is like.
    void expect(Names names, double neutral, const char* consequence);
    /// Does not change the image.
    void ignore(Names names);
    /// Warns of all that is authored and nobody asked for.
    void warn_rest();

    void warn(const std::string& code, const std::string& message);

    Prim filter() const { return filter_; }

  private:
    /// Where its value is: of the first name that is authored; warns of shaders that feed it.
    usd::stage::Attribute find(Names names);

    Context& ctx_;
    Prim filter_;
    std::map<std::string, usd::stage::Attribute, std::less<>> attributes_;  // authored, by name
    std::set<std::string, std::less<>> asked_;
};

}  // namespace velatura::translate::lights
