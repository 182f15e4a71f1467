#pragma once

#include <array>
#include <string_view>

namespace report {

/// The files of page/, as they are. page.html has places for the rest: {{style}}, {{report}},
/// {{pictures}} and {{script}}, in this order.
[[nodiscard]] std::string_view page_html();
[[nodiscard]] std::string_view page_css();
/// The parts of one script, in order.
[[nodiscard]] std::array<std::string_view, 6> page_scripts();

}  // namespace report
