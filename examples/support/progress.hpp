#pragma once

#include <string>
#include <utility>

namespace support {

/// One line on stderr that says what is being done. Silent when stderr is no terminal.
class Progress {
public:
    Progress();
    Progress(const Progress&) = delete;
    Progress& operator=(const Progress&) = delete;
    ~Progress() { clear(); }

    /// What follows belongs to this scene.
    void scene(int number, int count, const std::string& name);
    void step(const std::string& what);
    /// The share of the current step that is done.
    void share(double done);
    void clear();

private:
    void show(const std::string& line);

    bool terminal_ = false;
    std::string scene_, step_;
    int percent_ = -1;
    std::size_t shown_ = 0;
};

}  // namespace support
