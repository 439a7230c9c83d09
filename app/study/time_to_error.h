#pragma once
// How long a scheme takes to come to an error, where it was tried on several cells, or with several lengths of steps: what schemes cost that are
// not equally accurate on the same cells.
#include <array>
#include <string>
#include <vector>

#include "app/study/study.h"

namespace app {

/// Of one scheme's variants those that none of its others beats in both the case's deciding error and seconds; from fast to slow, and so from the
/// largest error on.
std::vector<const Variant*> own_front(const Study&, const StudyCase&, const std::string& scheme);

/// The schemes of a case, in the order of the ladder.
std::vector<std::string> schemes_of(const Study&, const StudyCase&);

/// At round errors, 1, 2 and 5 times a power of ten, that two schemes at least come to; at the least of those errors where there is no round one; at
/// none where fewer than two ran. Between two variants of a scheme's own front seconds are a power of the error.
TimeToError time_to_error(const Study&, const StudyCase&);

/// Who takes least to the least error that half of the schemes come to, how many times as long the others take, and who does not come to it. There must
/// be a level.
std::array<std::string, 3> sentences_of(const TimeToError&, const std::string& error);

}  // namespace app
