"""Sensitivity to delta and e: free rocking against its closed form, paired comparisons, findings and claims."""
