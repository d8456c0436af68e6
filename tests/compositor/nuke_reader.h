// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "image/image.h"

#include <array>
#include <functional>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace velatura::compositor {

/// The value of a Nuke expression of numbers, + - * / == || ?: ( ) and pow. Names are looked up.
double nuke_value(const std::string& expression,
                  const std::function<double(const std::string&)>& look_up);

/// Runs a Nuke script of a Read and a Group of Shuffle, Multiply, Merge2 (plus), Cryptomatte and
/// Copy by Nuke's rules: nodes take their inputs from a stack, `set` names its top, `push` puts a
/// node back, and knobs of nodes in the group are expressions of those of the group.
class NukeReader {
  public:
    using Pixels = std::array<std::vector<float>, 4>;

    /// `turned`: knobs of the group that a person has set after the script was opened.
    NukeReader(const std::string& text,
               const image::Image& layers,
               const std::map<std::string, std::vector<double>>& turned = {});

    const Pixels& result() const { return stack_.back(); }

    std::string file;   ///< the Read's knob, as Nuke evaluates it in the script's folder FOLDER
    std::string range;  ///< "first last" of the Read, if it has them
    std::map<std::string, std::vector<double>> knobs;  ///< of the group
    std::map<std::string, std::string> labels;         ///< of these
    std::set<std::string> nodes;                       ///< names within the group
    std::vector<std::string> matte_lists;

  private:
    using Knobs = std::map<std::string, std::string>;

    void run(const std::string& line);
    bool next(std::string& line);
    Knobs block();
    void group();
    void node(const std::string& kind, const Knobs& knobs);
    Pixels pop();
    Pixels layer(const std::string& name) const;
    void multiply(const Knobs& knobs);
    void cryptomatte(const Knobs& knobs);

    std::vector<std::string> lines_;
    size_t at_ = 0;
    const image::Image& layers_;
    std::vector<Pixels> stack_;
    std::map<std::string, Pixels> named_;
};

}  // namespace velatura::compositor
