"""Many runs: experiments as data, carried out in parallel, compared by statistics, written up as a report."""
