"""Final gather: irradiance at few receivers from rays into the radiance cache, and what that says of all the others.

Irradiance changes slowly along surfaces. Receivers are put into cells (`cells`); one receiver of each cell gathers and
keeps what it found as a record (`records`), with more cells where records disagree (`placement`). All receivers take a
local fit of the records around them that they see (`record_index`). Then rays go to the records to whose noise the
error of all is most sensitive (`sample_budget`), until the noise is as low, or the time is as far gone, as was asked
for (`final_gather`).
"""

from .final_gather import FinalGather, Gathered
from .sample_budget import SampleBudget

__all__ = ["FinalGather", "Gathered", "SampleBudget"]
