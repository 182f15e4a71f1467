#include "progress.hpp"

#include <cstdio>

#if __has_include(<unistd.h>)
#include <unistd.h>
#endif

namespace support {

Progress::Progress()
{
#if __has_include(<unistd.h>)
    terminal_ = isatty(STDERR_FILENO) != 0;
#endif
}

void Progress::scene(int number, int count, const std::string& name)
{
    scene_ = '[' + std::to_string(number) + '/' + std::to_string(count) + "] " + name + ": ";
}

void Progress::step(const std::string& what)
{
    step_ = what;
    percent_ = -1;
    show(scene_ + step_);
}

void Progress::share(double done)
{
    const int percent = static_cast<int>(100 * done);
    if (percent == percent_) return;
    percent_ = percent;
    show(scene_ + step_ + ' ' + std::to_string(percent) + " %");
}

void Progress::clear() { show({}); }

void Progress::show(const std::string& line)
{
    if (!terminal_ || (line.empty() && shown_ == 0)) return;
    std::string padded = line;
    if (padded.size() < shown_) padded.append(shown_ - padded.size(), ' ');
    std::fprintf(stderr, "\r%s%s", padded.c_str(), line.empty() ? "\r" : "");
    std::fflush(stderr);
    shown_ = line.size();
}

}  // namespace support
