// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace velatura::test {

/// What a finished command left behind.
struct CommandResult {
    int exit_code = -1;
    std::string output;  ///< stdout and stderr together
};

/// A folder of its own for each test, removed afterwards; commands run inside it.
class Workplace {
  public:
    Workplace();
    ~Workplace();
    Workplace(const Workplace&) = delete;
    Workplace& operator=(const Workplace&) = delete;

    /// Runs `velatura` (or `velatura-comp`) with arguments of a shell.
    CommandResult velatura(const std::string& arguments) const {
        return run("velatura", arguments);
    }

    CommandResult comp(const std::string& arguments) const {
        return run("velatura-comp", arguments);
    }

    void write(const std::string& name, const std::string& content) const;
    bool exists(const std::string& name) const;

    std::string path(const std::string& name) const { return folder_ + "/" + name; }

    /// Names of files in the folder beside those given, sorted and joined by spaces.
    std::string files_beside(const std::string& known) const;
    /// SHA-256 of all pixel data, as `velatura-comp info --hash` prints it.
    std::string hash(const std::string& exr) const;

    CommandResult run(const std::string& program, const std::string& arguments) const;

  private:
    std::string folder_;
};

/// Copies scenes/NAME of the project to scenes/NAME of the workplace and makes what it generates.
/// Returns: false where a library that its generator needs is not installed.
bool copy_made_scene(const Workplace& w, const std::string& name);

/// A lit corner with two named lights and a dome.
std::string small_scene();

/// Prims "S" and "M": a ball whose color is that of a file.
std::string textured_ball(const std::string& file);

}  // namespace velatura::test
