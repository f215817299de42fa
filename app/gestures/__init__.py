"""The gesture database: records, store, enrolment, import and export."""
