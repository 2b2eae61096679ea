"""OpenQuake's fragility models (NRML 0.5), written."""
