#pragma once
// Text that may be anything a user has typed, as what pages and plots can hold; and numbers as people say them.
#include <string>

namespace app {

/// Control characters (but tabs and line ends) and what is no UTF-8 become U+FFFD.
std::string clean_text(const std::string&);

/// Clean text in HTML: & < > " and ' are written as references.
std::string html_text(const std::string&);

/// "1.3", "24": of two numbers.
std::string ratio_text(double ratio);

}  // namespace app
