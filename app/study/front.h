#pragma once
// Which variants are worth their time.
#include <string>

#include "app/study/study.h"

namespace app {

/// Median, least and most of `seconds`.
void sum_up_seconds(Variant&);

/// The spreads of their times overlap, 5 % of it added (25 % where one was measured once): measured again, the order of the two may be another.
bool is_tie(const Variant&, const Variant&);

/// Where CPU seconds put variants the other way round than the clock does by more than a fourth: a line that says so.
std::string doubt_of_the_clock(const Study&);

/// Of every case: ties, the Pareto front of the deciding error against the median of the seconds, and the three sentences. An error that is absent
/// counts as the case's noise. Of two that are as fast the one with less error is on the front; of two with the same error (to 1 %) the faster one.
/// The best value is the one on the front with the least product of error and seconds. Of what was refined the sentences are those of the times to an
/// error, where two schemes come to one.
void judge(Study&);

}  // namespace app
